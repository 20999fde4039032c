"""A robot at rest as Python sees it: shapes, tensions, derivatives, vibrations, reach; no experiment is needed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from tcrctl.errors import InfeasibleError, InputError
from tcrctl.experiment.feasibility import DriveLimits, Held, hold_pose
from tcrctl.robot import pose
from tcrctl.robot.description import RobotDescription, load_robot
from tcrctl.robot.equilibrium import Equilibrium, equilibrium
from tcrctl.robot.modes import modes
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Array
from tcrctl.workspace.ray import Limits, follow
from tcrctl.workspace.workspace import Workspace, directions, joined

Drives: TypeAlias = Sequence[float] | Array


@dataclass(frozen=True, slots=True)
class Shape:
    """A robot at rest.

    Attributes:
        drive: Drive lengths (m,) [m].
        nodes: Node positions (n_nodes, 3) [m]; row 4 i + j is node j of module i.
        position: End position (3,) [m].
        normal: Unit end normal (3,).
        tension: Cable tensions (m,) [N]; 0 where a cable is slack.
        length: Path lengths of the cables (m,) [m].
    """

    drive: Array
    nodes: Array
    position: Array
    normal: Array
    tension: Array
    length: Array


@dataclass(frozen=True, slots=True)
class Modes:
    """The lowest natural vibrations about a robot at rest, slowest first; undamped.

    Attributes:
        frequency: Natural frequencies (count,) [Hz].
        shape: Mode shapes (count, n_nodes, 3), of a modal mass of 1 kg [1/sqrt(kg)]; the base does not move.
    """

    frequency: Array
    shape: Array


class Robot:
    """A robot by its file; drives are lengths (m,) [m] in the order of ``cables``, zero as built.

    Attributes:
        description: What the file says.
        name: Name of the robot.
        cables: Names of its cables.
        stroke: Limits of the drive lengths (2,) [m].
        tension_limit: Largest tension allowed [N].
    """

    def __init__(self, name_or_path: str | os.PathLike[str]) -> None:
        """Read and string a robot.

        Args:
            name_or_path: Name of a shipped robot, or path of a robot file.

        Raises:
            InputError: If there is none, or its file has problems.
            NoEquilibriumError: If it has no stable shape at zero drive.
        """
        self.description: RobotDescription = load_robot(os.fspath(name_or_path))
        self._robot = build_robot(self.description)
        self.name, self.cables = self._robot.name, self._robot.cable_names
        self.stroke, self.tension_limit = self._robot.stroke, self._robot.tension_limit

    def __repr__(self) -> str:
        return f"Robot({self.name!r})"

    def statics(self, drive: Drives | None = None) -> Shape:
        """Return the robot at rest.

        Args:
            drive: Drive lengths (m,) [m]; zero if None. Strokes and tensions are not held against limits.

        Raises:
            InputError: If these are no drive lengths.
            NoEquilibriumError: If it has no stable shape with them.
        """
        drive = self._drive(drive)
        return self._shape(drive, self._rest(drive))

    def jacobian(self, drive: Drives | None = None) -> Array:
        """Return the derivatives of the end pose at rest by the drives (6, m).

        Rows 0-2: end position [m/m]; rows 3-5: end normal [1/m]. Slack cables count as slack.

        Args:
            drive: As for :meth:`statics`, which raises the same.
        """
        at = self._rest(self._drive(drive))
        found: Array = pose.drive_gain(at.q, at.gain, self._robot.tip)[:6]
        return found

    def modes(self, drive: Drives | None = None, count: int = 6) -> Modes:
        """Return the lowest natural vibrations about the robot at rest.

        Args:
            drive: As for :meth:`statics`, which raises the same.
            count: How many.
        """
        model, weight = self._robot.model, self._robot.weight
        drive = self._drive(drive)
        at = self._rest(drive)
        free = at.gain.shape[0]
        if not 1 <= count <= free:
            raise InputError(f"modes: count must be 1 to {free}, not {count}")
        found = modes(model, at, drive, weight, count)
        shape = np.zeros((count, at.q.size))
        shape[:, at.q.size - free :] = found.shape.T
        return Modes(found.frequency, shape.reshape(count, -1, 3))

    def inverse(self, position: Drives, normal: Drives | None = None, floor: float = 0.5) -> Shape:
        """Return the robot at rest with its end at a place.

        Args:
            position: End position (3,) [m], world frame.
            normal: Unit end normal (3,); free if None.
            floor: Lowest tension that is aimed at where the robot has more cables than the pose needs [N].

        Raises:
            InputError: If these are no vectors.
            InfeasibleError: If the end stays more than 1 mm, or half a degree, away.
        """
        given = [_vector("position", position, 3)]
        given += [] if normal is None else [_vector("normal", normal, 3)]
        limits = DriveLimits(np.inf, floor, self.tension_limit)
        start = Held(np.zeros(len(self.cables)), self._robot.rest)
        held, error = hold_pose(self._robot, np.concatenate(given), start, limits)
        if error > 1.0:
            raise InfeasibleError(0.0, "distance of the end from its pose", error, 1.0, "mm or half degrees")
        return self._shape(held.drive, held.shape)

    def workspace(self, rays: int = 256, floor: float = 0.5, ceiling: float | None = None) -> Workspace:
        """Return end poses that are reached at rest with taut cables, as ``tcrctl workspace`` finds them.

        Args:
            rays: Directions in the space of drives along which it is followed.
            floor: Lowest tension [N].
            ceiling: Highest tension [N]; the robot's limit if None.
        """
        if rays < 1:
            raise InputError(f"workspace: rays must be at least 1, not {rays}")
        limits = Limits(floor, self.tension_limit if ceiling is None else ceiling, spacing=4e-3)
        found = [follow(self._robot, toward, limits) for toward in directions(rays, len(self.cables))]
        return joined(self.name, self.cables, found)

    def _rest(self, drive: Array) -> Equilibrium:
        robot = self._robot
        return equilibrium(robot.model, drive, robot.weight, robot.rest.q)

    def _drive(self, given: Drives | None) -> Array:
        m = len(self.cables)
        return np.zeros(m) if given is None else _vector("drive", given, m)

    def _shape(self, drive: Array, at: Equilibrium) -> Shape:
        tip = self._robot.tip
        nodes = at.q.reshape(-1, 3).copy()
        ends = pose.position(at.q, tip), pose.normal(at.q, tip)
        return Shape(drive.copy(), nodes, *ends, at.tension.copy(), at.length.copy())


def _vector(name: str, given: Any, size: int) -> Array:
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be {size} numbers") from None
    if found.shape != (size,) or not np.isfinite(found).all():
        raise InputError(f"{name} must be {size} finite numbers, not of shape {found.shape}")
    return found
