"""A plant from elsewhere: what it measures is checked in every step, and its errors are a safe stop."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcrctl.errors import PluginStoppedError
from tcrctl.plant.settings import PlantSection
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.handed import handed
from tcrctl.plugins.plugin import Plugin
from tcrctl.robot.module import ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Measurement, Truth


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
        self._nodes = robot.rest.q.size
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
        return handed(found)  # a plant may fill the same arrays again before the log has written them

    def write(self, command: Command) -> Command:
        """Send a command; returns what was really sent.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        sent = called(self._origin, "write", self._made.write, handed(command))
        if not isinstance(sent, Command):
            raise self._refused("write", f"a {type(sent).__name__}, not the Command that was sent")
        return Command(
            self._vector("write", "speed", sent.speed, self._cables),
            self._vector("write", "drive", sent.drive, self._cables),
        )

    def truth(self) -> Truth | None:
        """Return what it knows about itself at the time of the last ``read``, if it knows more than it measures."""
        found = called(self._origin, "truth", self._made.truth) if hasattr(self._made, "truth") else None
        if found is not None and not isinstance(found, Truth):
            raise self._refused("truth", f"a {type(found).__name__}, not a Truth")
        if found is None:
            return None
        sizes = {"position": 3, "normal": 3, "tension": self._cables, "q": self._nodes}
        checked = {name: self._vector("truth", name, getattr(found, name), n) for name, n in sizes.items()}
        return Truth(**checked)

    def close(self) -> None:
        """Leave the robot in a safe state."""
        called(self._origin, "close", self._made.close)

    def _vector(self, function: str, name: str, values: Any, size: int) -> Array:
        """Return a copy of a vector of finite numbers."""
        try:
            found = np.array(values, dtype=float)
        except (TypeError, ValueError):
            raise self._refused(function, f"{name} that are no numbers") from None
        if found.shape != (size,):
            raise self._refused(function, f"{name} of shape {found.shape}, not ({size},)")
        if not np.isfinite(found).all():
            raise self._refused(function, f"{name} that is not finite")
        return found

    def _refused(self, name: str, what: str) -> PluginStoppedError:
        return PluginStoppedError(self._origin.what, f"{name} returned {what}")
