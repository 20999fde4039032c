"""``kind: drives``: given drive lengths, as in the model evaluation of [TCR, Sec. V.B].

The end pose that goes with them is the one in which the model comes to rest, so it is what a slow motion shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.drive_settings import DriveLegSettings, DrivesSettings
from tcrctl.trajectory.time_law import Phase, TimeLaw

MM = 1e-3  # [m]
SPACING = 2.5 * MM  # of the drive lengths at which the end pose is computed; linear in between [m]


@dataclass(frozen=True, slots=True)
class DrivesTrajectory:
    """Drive lengths over time and the end poses at rest that go with them.

    Attributes:
        corners: Drive lengths between the legs (legs + 1, m) [m].
        time_law: Leg parameter over time, leg i from i to i + 1.
        s: Leg parameters of the computed end poses (k,).
        positions: End positions there (k, 3) [m].
        normals: Unit end normals there (k, 3).
    """

    corners: Array
    time_law: TimeLaw
    s: Array
    positions: Array
    normals: Array

    @property
    def duration(self) -> float:
        """Time until the end of the last rest [s]."""
        return self.time_law.total

    def drive(self, t: Array) -> Array:
        """Return drive lengths at times t (n,) [s] as (n, m) [m]; clamped beyond the ends."""
        legs = np.arange(self.corners.shape[0], dtype=float)
        return interpolated(self.time_law.arc_length(t), legs, self.corners)

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]."""
        return interpolated(self.time_law.arc_length(t), self.s, self.positions)

    def normal(self, t: Array) -> Array:
        """Return unit end normals at times t (n,) [s] as (n, 3)."""
        between = interpolated(self.time_law.arc_length(t), self.s, self.normals)
        normal: Array = between / np.linalg.norm(between, axis=1, keepdims=True)
        return normal


def build_drives(settings: DrivesSettings, robot: Robot) -> DrivesTrajectory:
    """Plan the legs and find the end poses along them.

    Args:
        settings: The drive lengths; as many per leg as the robot has cables.
        robot: The robot that the controller knows.

    Raises:
        NoEquilibriumError: If the model has no stable shape somewhere on the way.
    """
    corners = np.zeros((len(settings.legs) + 1, robot.n_cables))
    corners[1:] = MM * np.array([leg.drives_mm for leg in settings.legs])
    s = samples(corners)
    return DrivesTrajectory(corners, time_law(settings), s, *end_poses(corners, s, robot))


def time_law(settings: DrivesSettings) -> TimeLaw:
    """Return the leg parameter over time."""
    phases = [Phase(settings.lead_in_s, 0.0, 0.0)]
    for leg in settings.legs:
        phases += [*_leg_phases(leg), Phase(leg.dwell_s, 0.0, 0.0)]
    phases.append(Phase(settings.settle_s, 0.0, 0.0))
    return TimeLaw.of([phase for phase in phases if phase.duration > 0.0])


def _leg_phases(leg: DriveLegSettings) -> list[Phase]:
    duration = leg.duration_s
    if leg.motion == "constant_speed":
        return [Phase(duration, 1.0 / duration, 1.0 / duration)]
    top = 2.0 / duration
    return [Phase(0.5 * duration, 0.0, top), Phase(0.5 * duration, top, 0.0)]


def samples(corners: Array) -> Array:
    """Return leg parameters (k,) so close that no drive changes by more than the spacing between two."""
    counts = [max(1, int(np.ceil(np.max(np.abs(b - a)) / SPACING))) for a, b in pairwise(corners)]
    parts = [i + np.arange(count) / count for i, count in enumerate(counts)]
    return np.concatenate([*parts, [float(len(counts))]])


def end_poses(corners: Array, s: Array, robot: Robot) -> tuple[Array, Array]:
    """Return end positions (k, 3) [m] and unit normals (k, 3) of the model at rest.

    Args:
        corners: Drive lengths between the legs (legs + 1, m) [m].
        s: Leg parameters in order (k,), beginning at 0.
        robot: The robot.
    """
    drives = interpolated(s, np.arange(corners.shape[0], dtype=float), corners)
    positions, normals = np.empty((s.size, 3)), np.empty((s.size, 3))
    q, before = robot.rest.q, np.zeros(robot.n_cables)
    for i, drive in enumerate(drives):
        q, before = equilibrium(robot.model, drive, robot.weight, q, before).q, drive
        positions[i], normals[i] = pose.position(q, robot.tip), pose.normal(q, robot.tip)
    return positions, normals


def interpolated(s: Array, at: Array, values: Array) -> Array:
    """Return the linear interpolation of every column of values (k, c) given at (k,); (n, c) at s (n,)."""
    return np.stack([np.interp(s, at, column) for column in values.T], axis=1)
