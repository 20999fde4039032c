"""``kind: steps``: a staircase of the drives, cable by cable or all together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.drive_settings import DriveLegSettings, DrivesSettings
from tcrctl.trajectory.drives import DrivesTrajectory, build_drives
from tcrctl.trajectory.wave_settings import StepsSettings


def build_steps(settings: StepsSettings, robot: Robot) -> DrivesTrajectory:
    """Plan the staircase and find the end poses along it.

    Raises:
        NoEquilibriumError: If the model has no stable shape somewhere on the way.
    """
    middle = np.array(settings.middle_mm or np.zeros(robot.n_cables))
    program = DrivesSettings(
        kind="drives",
        legs=tuple(_legs(settings, middle)),
        lead_in_s=settings.lead_in_s,
        settle_s=settings.settle_s,
    )
    return build_drives(program, robot)


def _legs(settings: StepsSettings, middle: Array) -> Iterator[DriveLegSettings]:
    if middle.any():
        yield _leg(middle, settings.move_s, settings.rest_s, "smooth")
    patterns = np.eye(middle.size) if settings.cables == "each" else np.ones((1, middle.size))
    for pattern in patterns:
        for level in (*settings.levels_mm, 0.0):
            yield _leg(middle + level * pattern, settings.rise_s, settings.rest_s, "constant_speed")
    if middle.any():
        yield _leg(np.zeros(middle.size), settings.move_s, 0.0, "smooth")


def _leg(
    drives: Array, duration: float, dwell: float, motion: Literal["smooth", "constant_speed"]
) -> DriveLegSettings:
    return DriveLegSettings(
        drives_mm=tuple(drives.tolist()), duration_s=duration, dwell_s=dwell, motion=motion
    )
