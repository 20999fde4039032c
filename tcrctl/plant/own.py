"""A plant from elsewhere: what it measures is checked in every step, and its errors are a safe stop."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcrctl.errors import PluginStoppedError
from tcrctl.plant.settings import PlantSection
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.plugin import Plugin
from tcrctl.robot.module import ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Command, Measurement, Truth


class OwnPlant:
    """Calls ``read``, ``write``, ``close`` and, where there are, ``start`` and ``truth``, of what was built.

    The builder is called with settings, the controller's robot, the control period [s] and the seed.
    """

    def __init__(
        self, settings: PlantSection, plugin: Plugin, robot: Robot, period: float, seed: int
    ) -> None:
        """Build it.

        Raises:
            InputError: If the builder raises, or what it returns is no plant.
        """
        self._origin = plugin.origin
        self._markers, self._cables = len(ring_rows(robot.n_modules)), robot.n_cables
        self._made = built(plugin.origin, plugin.build, settings, robot, period, seed)
        refuse_lacking(plugin.origin, self._made, ("read", "write", "close"))

    def start(self) -> None:
        """Get it ready to be driven."""
        if hasattr(self._made, "start"):
            called(self._origin, "start", self._made.start)

    def read(self) -> Measurement:
        """Return the newest measurement.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        found = called(self._origin, "read", self._made.read)
        if not isinstance(found, Measurement):
            raise self._refused("read", f"a {type(found).__name__}, not a Measurement")
        shapes = {"nodes": (self._markers, 3), "valid": (self._markers,), "drive": (self._cables,)}
        types = {"nodes": np.float32, "valid": np.bool_, "drive": np.float64}
        for name, shape in shapes.items():
            values: Any = getattr(found, name)
            if getattr(values, "shape", None) != shape or values.dtype != types[name]:
                raise self._refused("read", f"{name} that are no {types[name].__name__} of shape {shape}")
        if not np.isfinite(found.drive).all() or not np.isfinite(found.nodes[found.valid]).all():
            raise self._refused("read", "values that are no finite numbers")
        return found

    def write(self, command: Command) -> Command:
        """Send a command; returns what was really sent.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        sent = called(self._origin, "write", self._made.write, command)
        if not isinstance(sent, Command):
            raise self._refused("write", f"a {type(sent).__name__}, not the Command that was sent")
        if sent.speed.shape != (self._cables,) or sent.drive.shape != (self._cables,):
            raise self._refused("write", f"a Command of another shape than ({self._cables},)")
        return sent

    def truth(self) -> Truth | None:
        """Return what it knows about itself at the time of the last ``read``, if it knows more than it measures."""
        found = called(self._origin, "truth", self._made.truth) if hasattr(self._made, "truth") else None
        if found is not None and not isinstance(found, Truth):
            raise self._refused("truth", f"a {type(found).__name__}, not a Truth")
        return found

    def close(self) -> None:
        """Leave the robot in a safe state."""
        called(self._origin, "close", self._made.close)

    def _refused(self, name: str, what: str) -> PluginStoppedError:
        return PluginStoppedError(self._origin.what, f"{name} returned {what}")
