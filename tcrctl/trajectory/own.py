"""A trajectory from elsewhere: what it returns is checked before the run, and whenever it is asked."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from tcrctl.errors import InputError, PluginStoppedError
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.plugin import Plugin
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.section import TrajectorySection

#: Instants at which it is tried when it is built.
PROBES: Final = 7
#: How far the length of a normal may be from 1.
UNIT: Final = 1e-6


class OwnTrajectory:
    """Calls ``position(t)`` and, where there are, ``normal(t)`` and ``drive(t)`` of what a builder returned.

    Attributes:
        duration: Time from the first to the last motion [s].
    """

    duration: float

    def __init__(self, settings: TrajectorySection, plugin: Plugin, robot: Robot) -> None:
        """Build and try it.

        Raises:
            InputError: If the builder raises, or what it returns is no trajectory.
        """
        self._origin, self._cables = plugin.origin, robot.n_cables
        self._made = built(plugin.origin, plugin.build, settings, robot)
        refuse_lacking(plugin.origin, self._made, ("duration", "position"))
        self.duration = built(plugin.origin, float, self._made.duration)
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise InputError(f"{plugin.origin.what}: its duration is {self.duration:g} s; it must be > 0")
        try:
            for ask in (self.position, self.normal, self.drive):
                ask(np.linspace(0.0, self.duration, PROBES))
        except PluginStoppedError as error:
            raise InputError(f"{plugin.origin.what}: {error.cause}") from error

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m].

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        return self._asked("position", t, 3)

    def normal(self, t: Array) -> Array | None:
        """Return unit end normals at times t (n,) [s] as (n, 3), or None if the orientation is free."""
        found = self._optional("normal", t, 3)
        if found is not None and (np.abs(np.linalg.norm(found, axis=1) - 1.0) > UNIT).any():
            raise PluginStoppedError(self._origin.what, "normal returned vectors whose length is not 1")
        return found

    def drive(self, t: Array) -> Array | None:
        """Return drive lengths at times t (n,) [s] as (n, m) [m], or None if it gives none."""
        return self._optional("drive", t, self._cables)

    def _optional(self, name: str, t: Array, columns: int) -> Array | None:
        if not hasattr(self._made, name):
            return None
        found = called(self._origin, name, getattr(self._made, name), t.copy())
        return None if found is None else self._checked(name, found, (t.size, columns))

    def _asked(self, name: str, t: Array, columns: int) -> Array:
        found = called(self._origin, name, getattr(self._made, name), t.copy())
        return self._checked(name, found, (t.size, columns))

    def _checked(self, name: str, values: Any, shape: tuple[int, int]) -> Array:
        try:
            found = np.array(values, dtype=float)
        except (TypeError, ValueError):
            raise PluginStoppedError(self._origin.what, f"{name} returned no numbers") from None
        if found.shape != shape:
            what = f"{name} of {shape[0]} times returned shape {found.shape}, not {shape}"
            raise PluginStoppedError(self._origin.what, what)
        if not np.isfinite(found).all():
            raise PluginStoppedError(self._origin.what, f"{name} returned values that are no finite numbers")
        return found
