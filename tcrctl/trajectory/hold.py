"""``kind: hold``: stand still at the rest pose, or take a step beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.settings import HoldSettings


@dataclass(frozen=True, slots=True)
class HoldTrajectory:
    """One constant target.

    Attributes:
        duration: How long [s].
        target: End position (3,) [m].
        target_normal: End normal (3,), or None for position only.
    """

    duration: float
    target: Array
    target_normal: Array | None

    def position(self, t: Array) -> Array:
        """Return the target at times t (n,) [s] as (n, 3) [m]."""
        return np.tile(self.target, (t.size, 1))

    def normal(self, t: Array) -> Array | None:
        """Return the target normal at times t (n,) [s] as (n, 3), or None."""
        return None if self.target_normal is None else np.tile(self.target_normal, (t.size, 1))


def build_hold(settings: HoldSettings, robot: Robot) -> HoldTrajectory:
    """Build a constant target.

    Args:
        settings: Duration, offset and whether the orientation counts.
        robot: The robot whose rest pose is meant.
    """
    target = robot.rest_position + 1e-3 * np.array(settings.offset_mm)
    return HoldTrajectory(
        settings.duration_s, target, robot.rest_normal if settings.orientation == "rest" else None
    )
