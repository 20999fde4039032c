"""The vector of unknowns x: groups with a name each, and the standard deviation of every entry beforehand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.module import LABELS, is_ring_node, node_names
from tcrctl.signals import Array

XYZ = ("x", "y", "z")
ROOT3 = math.sqrt(3.0)
ROOT2 = math.sqrt(2.0)
#: Groups that change the camera's picture, not the robot.
SEEN = ("frame_rotation", "frame_translation", "markers")
#: What play leaves of the way to a rest.
WAY = ("backlash",)


@dataclass(frozen=True, slots=True)
class Group:
    """Unknowns of one kind, in SI units and rad, or relative.

    Attributes:
        name: Of the group.
        members: Name of every unknown in it.
        prior: Standard deviation of each beforehand.
    """

    name: str
    members: tuple[str, ...]
    prior: float


class Unknowns:
    """All groups one after the other.

    Attributes:
        groups: The groups.
        names: ``group.member`` of every unknown.
        prior: Standard deviations beforehand (n,).
    """

    def __init__(self, groups: Sequence[Group]) -> None:
        self.groups = tuple(groups)
        self.names = tuple(f"{g.name}.{m}" if m else g.name for g in groups for m in g.members)
        self.prior = np.concatenate([np.full(len(g.members), g.prior) for g in groups])
        ends = np.cumsum([len(g.members) for g in groups])
        self._slices = {
            g.name: slice(int(e) - len(g.members), int(e)) for g, e in zip(groups, ends, strict=True)
        }

    def __len__(self) -> int:
        """Return the number of unknowns n."""
        return len(self.names)

    def of(self, name: str) -> slice:
        """Return where a group is."""
        return self._slices[name]

    def take(self, x: Array, name: str) -> Array:
        """Return the entries of a group out of x (n,)."""
        return x[self.of(name)]

    def columns(self, *, robot: bool) -> NDArray[np.intp]:
        """Return which unknowns change the shape of the robot at given cable lengths, or those which do not."""
        inside = np.zeros(len(self), dtype=np.bool_)
        for group in self.groups:
            inside[self.of(group.name)] = group.name not in (*SEEN, *WAY)
        return np.flatnonzero(inside == robot)


def make_unknowns(description: RobotDescription, spec: SelfCalibrationSpec) -> Unknowns:
    """List what is unknown of a robot, its drives and its cameras."""
    p, k, count = spec.priors, spec.scale, description.modules.count
    routes, mm = cable_routes(description), 1e-3
    cables = tuple(route.name for route in routes)
    modules = tuple(f"m{i}" for i in range(1, count + 1))
    holes = tuple(f"{route.name}.{i}" for route in routes for i in range(len(route.holes)))
    nodes = tuple(f"{m}.{label}.{c}" for m in modules for label in LABELS for c in XYZ)
    rings = [n for n in node_names(count) if is_ring_node(n) and not n.startswith("base.")]
    return Unknowns(
        [
            Group("springs", ("",), p.springs),
            Group("density", ("",), p.density),
            Group("tension", ("",), k * p.tension),
            Group("zeros", cables, k * mm * p.zeros_mm),
            Group("radius", cables, k * p.radius),
            Group("tilt", ("x", "y"), k * math.radians(p.tilt_deg) / ROOT2),
            Group("joint_springs", spring_groups(description), k * p.joint_springs),
            Group("masses", modules, k * p.masses),
            Group("holes", holes, k * math.radians(p.holes_deg)),
            Group("geometry", nodes, k * mm * p.geometry_mm),
            Group("backlash", ("",), k * mm * p.backlash_mm),
            Group("frame_rotation", XYZ, k * math.radians(p.frame_deg) / ROOT3),
            Group("frame_translation", XYZ, k * mm * p.frame_mm / ROOT3),
            Group("markers", tuple(f"{n}.{c}" for n in rings for c in XYZ), k * mm * p.marker_mm / ROOT3),
        ]
    )


def spring_groups(description: RobotDescription) -> tuple[str, ...]:
    """Return the names of what has springs of its own: every joint, and every further spring."""
    springs, count = description.springs, description.modules.count
    joints = tuple(f"joint{i}" for i in range(1, count + 1)) if springs.joint else ()
    return (*joints, *(f"between{i}" for i in range(1, len(springs.between) + 1)))


def spring_group_of(description: RobotDescription) -> NDArray[np.int64]:
    """Return the group of every spring, in the order of the springs (n_springs,)."""
    springs, count = description.springs, description.modules.count
    of_joints = np.repeat(np.arange(count), len(springs.joint))
    joints = count if springs.joint else 0
    return np.concatenate([of_joints, joints + np.arange(len(springs.between))]).astype(np.int64)
