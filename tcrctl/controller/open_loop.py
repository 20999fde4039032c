"""``kind: open_loop``: moves the drives to the lengths that the trajectory gives, whatever the end does.

Set-points follow the trajectory, not the drives: those that lag, and answer after a dead time, would be chased.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.settings import OpenLoopSettings, speed_limit
from tcrctl.errors import InputError
from tcrctl.memory import Kept
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference


class OpenLoop:
    """Follows given drive lengths.

    Attributes:
        ahead: The end of the coming period (1,) [s].
    """

    ahead: Array

    def __init__(self, settings: OpenLoopSettings, robot: Robot) -> None:
        self._period, self._limit = settings.period_s, speed_limit(settings)
        self._stroke = robot.stroke
        self.ahead = np.array([settings.period_s])

    def sharpen(self) -> None:
        """Do nothing: nothing is solved."""

    def memory(self) -> Mapping[str, Kept]:
        """Return nothing: nothing is remembered."""
        return {}

    def inner_map(self) -> None:
        """Return None: nothing is iterated."""

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Return the command that brings the drives to their lengths by the end of the period, within the limits.

        Raises:
            InputError: If the trajectory gives no drive lengths.
        """
        if reference.drive is None:
            raise InputError("controller.kind: open_loop needs trajectory.kind: drives")
        wanted = (np.clip(reference.drive, *self._stroke) - estimate.set_point) / self._period
        speed = np.clip(wanted, -self._limit, self._limit)
        info = ControlInfo(
            converged=True,
            iterations=0,
            residual=0.0,
            lcp_residual=0.0,
            lcp_pivots=0,
            saturated=np.abs(wanted) > self._limit * (1.0 + 1e-9),
            predicted_tension=estimate.tension,
            integral=np.zeros(6),
        )
        return Command(speed, estimate.set_point + self._period * speed), info
