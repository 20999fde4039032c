"""A controller from elsewhere: what it returns is checked in every step, and what it leaves out is filled in."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcrctl.controller.settings import OwnControllerSection, speed_limit
from tcrctl.errors import PluginStoppedError
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.plugin import Plugin
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference


class OwnController:
    """Calls ``control(estimate, reference)`` of what a builder ``build(settings, robot)`` returned.

    That returns drive speeds (m,) [m/s], which are brought within speed limit and stroke; or a Command, which is
    sent as it is; or one of both with a ControlInfo.

    Attributes:
        ahead: Instants after the step at which it wants the reference (n,) [s]; the end of the coming period if it
            does not say.
    """

    ahead: Array

    def __init__(self, settings: OwnControllerSection, plugin: Plugin, robot: Robot) -> None:
        """Build it.

        Raises:
            InputError: If the builder raises, or what it returns has no ``control``.
        """
        self._origin, self._robot = plugin.origin, robot
        self._period, self._limit = settings.period_s, speed_limit(settings)
        self._made = built(plugin.origin, plugin.build, settings, robot)
        refuse_lacking(plugin.origin, self._made, ("control",))
        ahead = getattr(self._made, "ahead", [settings.period_s])
        self.ahead = built(plugin.origin, _instants, ahead)

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Return the command for the coming period, and how it was found.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        found = called(self._origin, "control", self._made.control, estimate, reference)
        asked, info = found if isinstance(found, tuple) and len(found) == 2 else (found, None)
        if isinstance(asked, Command):
            speed, drive = (self._vector(name, getattr(asked, name)) for name in ("speed", "drive"))
        else:
            speed = self._within_limits(self._vector("speed", asked), estimate.drive)
            drive = estimate.drive + self._period * speed
        if info is None:
            info = self._plain(speed, estimate)
        elif not isinstance(info, ControlInfo):
            raise self._refused(f"a {type(info).__name__} beside the command, not a ControlInfo")
        return Command(speed, drive), info

    def _within_limits(self, speed: Array, drive: Array) -> Array:
        low, high = ((end - drive) / self._period for end in self._robot.stroke)
        return np.clip(speed, np.clip(low, -self._limit, 0.0), np.clip(high, 0.0, self._limit))

    def _vector(self, name: str, values: Any) -> Array:
        try:
            found = np.array(values, dtype=float)
        except (TypeError, ValueError):
            raise self._refused(f"a {type(values).__name__} as {name}, not numbers") from None
        if found.shape != (self._robot.n_cables,):
            raise self._refused(f"{name} of shape {found.shape}, not ({self._robot.n_cables},)")
        return found

    def _refused(self, what: str) -> PluginStoppedError:
        return PluginStoppedError(self._origin.what, f"control returned {what}")

    def _plain(self, speed: Array, estimate: Estimate) -> ControlInfo:
        return ControlInfo(
            converged=True,
            iterations=0,
            residual=0.0,
            lcp_residual=0.0,
            lcp_pivots=0,
            saturated=np.abs(speed) >= self._limit * (1.0 - 1e-9),
            predicted_tension=estimate.tension,
            integral=np.zeros(3),
        )


def _instants(ahead: Any) -> Array:
    found = np.array(ahead, dtype=float)
    if found.ndim != 1 or not found.size or not np.isfinite(found).all() or (found < 0.0).any():
        raise ValueError(f"ahead must be a list of times after the step [s], not {ahead!r}")
    return found
