"""What devices have to know of the robot that hangs there: its markers for cameras, its cables for drives."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.markers import Located, NodeMarker
from tcr_hardware.rigid_transform import IDENTITY, RigidTransform
from tcrctl.plant.rig.devices import Sighting
from tcrctl.plant.rig.settings import Calibration, MarkerSettings, MountedRobot
from tcrctl.robot.module import node_index, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, RawFrame

BASE_NODES = ("base.n1", "base.n2", "base.n3")


@dataclass(frozen=True, slots=True)
class Mounting:
    """Markers that cameras look for, and where what they see lies.

    Attributes:
        markers: Which marker sits at which node.
        rows: Row of each of them in ``Sighting.nodes`` (n,).
        size: Number of rows of ``Sighting.nodes``.
        rest: Where they are while the robot is at rest (n, 3), world frame [m].
        transform: From the frame of the cameras to the world frame.
        gated: A marker that has jumped is not used; False if it may be anywhere.
    """

    markers: tuple[NodeMarker, ...]
    rows: NDArray[np.int64]
    size: int
    rest: Array
    transform: RigidTransform = IDENTITY
    gated: bool = True

    def sighting(self, located: Located, taken: float, raw: RawFrame) -> Sighting:
        """Return a frame in which these markers were looked for.

        Args:
            located: Where they were found, in their order.
            taken: Middle of the exposure on ``time.monotonic`` [s].
            raw: The frame as it came.
        """
        nodes = np.zeros((self.size, 3), np.float32)
        valid = np.zeros(self.size, np.bool_)
        nodes[self.rows[located.valid]] = located.positions[located.valid]
        valid[self.rows] = located.valid
        doubts = Counter(reason for reason in located.reasons if reason)
        text = ", ".join(f"{count} {reason}" for reason, count in sorted(doubts.items()))
        return Sighting(taken, nodes, valid, text, raw)


#: For work that needs no marker of the robot.
NO_MARKERS = Mounting((), np.zeros(0, np.int64), 0, np.zeros((0, 3)))


def mounting(mounted: MountedRobot, robot: Robot) -> Mounting:
    """Return what cameras look for on a robot.

    Args:
        mounted: Section of the rig file.
        robot: The robot.
    """
    wanted = node_markers(mounted.markers, robot.n_modules)
    row_of = {row: i for i, row in enumerate(ring_rows(robot.n_modules))}
    nodes = [node_index(marker.node) for marker in wanted]
    return Mounting(
        tuple(wanted),
        np.array([row_of[node] for node in nodes], dtype=np.int64),
        len(row_of),
        np.asarray(robot.rest.q.reshape(-1, 3)[nodes], float),
        transform(mounted.calibration),
    )


def base_mounting(markers: MarkerSettings) -> Mounting:
    """Return what cameras look for to find the base ring, in their own frame.

    Args:
        markers: Section of the rig file.
    """
    wanted = (NodeMarker(node, label=markers.base.format(node=i)) for i, node in enumerate(BASE_NODES, 1))
    return Mounting(tuple(wanted), np.arange(3), 3, np.zeros((3, 3)), gated=False)


def transform(calibration: Calibration) -> RigidTransform:
    """Return the way from the cameras' frame to that of the robot."""
    return RigidTransform.from_dict(calibration.model_dump())


def node_markers(markers: MarkerSettings, n_modules: int) -> list[NodeMarker]:
    """Return which marker sits on which ring node, in the order of the nodes.

    Args:
        markers: Section of the rig file.
        n_modules: Number of free modules.
    """
    rings = range(1, n_modules + 1) if markers.rings == "all" else markers.rings
    found: dict[str, NodeMarker] = {}
    if markers.labels is not None:
        for ring in rings:
            for node in (1, 2, 3):
                name = f"m{ring}.n{node}"
                found[name] = NodeMarker(name, label=markers.labels.format(ring=ring, node=node))
    for entry in markers.nodes:
        found[entry.node] = NodeMarker(entry.node, entry.label, entry.asset, entry.member)
    return [found[name] for name in sorted(found, key=node_index)]


@dataclass(frozen=True, slots=True)
class CableAxis:
    """One cable and the axis that moves it.

    Attributes:
        name: Of the cable.
        axis: Number of the axis, from 1.
        sign: -1 if the axis counts up when the cable is let out.
        low: Soft limit, cable let out [um].
        high: Soft limit, cable taken in [um].
        speed: Largest speed that is ever sent [um/s].
    """

    name: str
    axis: int
    sign: int
    low: int
    high: int
    speed: float


def cable_axes(mounted: MountedRobot, names: tuple[str, ...]) -> tuple[CableAxis, ...]:
    """Return the axes of a robot's cables.

    Args:
        mounted: Section of the rig file.
        names: Cables in the order of the drives.
    """
    cables = ((name, mounted.cables[name]) for name in names)
    return tuple(
        CableAxis(
            name,
            cable.axis,
            cable.sign,
            round(1e3 * cable.min_mm),
            round(1e3 * cable.max_mm),
            1e3 * cable.speed_limit_mm_s,
        )
        for name, cable in cables
    )
