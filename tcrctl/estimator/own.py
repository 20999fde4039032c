"""An estimator from elsewhere: what it returns is checked in every step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tcrctl.errors import PluginStoppedError
from tcrctl.estimator.section import EstimatorSection
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.plugin import Plugin
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Estimate, Measurement


class OwnEstimator:
    """Calls ``update(measured, applied)`` of what a builder ``build(settings, robot, period)`` returned."""

    def __init__(self, settings: EstimatorSection, plugin: Plugin, robot: Robot, period: float) -> None:
        """Build it.

        Raises:
            InputError: If the builder raises, or what it returns has no ``update``.
        """
        self._origin = plugin.origin
        self._made = built(plugin.origin, plugin.build, settings, robot, period)
        refuse_lacking(plugin.origin, self._made, ("update",))
        nodes, cables = robot.rest.q.size, robot.n_cables
        self._sizes = {"q": nodes, "v": nodes, "disturbance": nodes, "drive": cables, "tension": cables}
        self._sizes |= {"position": 3, "normal": 3}

    def sharpen(self) -> None:
        """Pass it on, if it can be sharpened."""
        if hasattr(self._made, "sharpen"):
            called(self._origin, "sharpen", self._made.sharpen)

    def update(self, measured: Measurement, applied: Command) -> Estimate:
        """Return the state at the time of ``measured``; what is sent last are the drives if it does not say.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        found = called(self._origin, "update", self._made.update, measured, applied)
        if not isinstance(found, Estimate):
            raise self._refused(f"a {type(found).__name__}, not an Estimate")
        arrays: dict[str, Any] = {name: self._vector(name, found, size) for name, size in self._sizes.items()}
        for name in ("set_point", "arrived"):
            given = getattr(found, name)
            arrays[name] = self._vector(name, found, len(found.drive)) if np.size(given) else arrays["drive"]
        return replace(found, **arrays)

    def _vector(self, name: str, found: Estimate, size: int) -> Array:
        try:
            values = np.array(getattr(found, name), dtype=float)
        except (TypeError, ValueError):
            raise self._refused(f"{name} that are no numbers") from None
        if values.shape != (size,):
            raise self._refused(f"{name} of shape {values.shape}, not ({size},)")
        if not np.isfinite(values).all():
            raise self._refused(f"{name} that is not finite")
        return values

    def _refused(self, what: str) -> PluginStoppedError:
        return PluginStoppedError(self._origin.what, f"update returned {what}")
