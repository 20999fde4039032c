"""Cameras from elsewhere: every frame is checked before it counts."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from tcrctl.errors import InputError
from tcrctl.plant.rig.devices import CameraStatus, Sighting
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.mounting import Mounting
from tcrctl.plant.rig.own_device import OwnDevice
from tcrctl.plant.rig.settings import CameraSection
from tcrctl.plugins.handed import handed
from tcrctl.plugins.plugin import Plugin
from tcrctl.signals import RawFrame

#: A frame may lie so far in the future by the errors of clocks [s]; one further off would never grow stale.
AHEAD: Final = 0.01
_MEMBERS: Final = ("identity", "rate", "clock", "next", "status", "checks", "close")
_RAW: Final = {"ids": np.int32, "positions": np.float32, "flags": np.int32}


class OwnCameras(OwnDevice):
    """Cameras that a plug-in has built from its settings and a :class:`Mounting`.

    Attributes:
        rate: Frames per second [Hz].
    """

    def __init__(self, settings: CameraSection, plugin: Plugin, mounting: Mounting) -> None:
        """Build them.

        Raises:
            DeviceError: If they cannot be reached.
            InputError: If the builder raises anything else, or what it returns are no cameras.
        """
        super().__init__(plugin, _MEMBERS, settings, mounting)
        self._size, self._last = mounting.size, b""
        try:
            self.rate = float(self.told("rate", float, int))
            if not 0.0 < self.rate < np.inf:
                raise InputError(f"{self._origin.what}: its rate is {self.rate:g} Hz")
        except BaseException:
            self.close()
            raise

    @property
    def clock(self) -> str:
        """Why frames do not say when they were taken; empty if they do."""
        return str(self.told("clock", str))

    def next(self, timeout: float, *, fresh: bool) -> Sighting | None:
        """Return the newest frame; one that repeats the last bit for bit is none.

        Raises:
            DeviceError: If the device raises, or returns what is no frame.
        """
        found = self.called("next", timeout, fresh=fresh)
        if found is None:
            return None
        self._check(self.checked("next", found, Sighting))
        seen: Sighting = handed(found)
        bits = seen.nodes.tobytes() + seen.valid.tobytes() + seen.raw.positions.tobytes()
        new, self._last = bits != self._last or not bits, bits
        return seen if new else None

    def _check(self, seen: Sighting) -> None:
        self._check_array("nodes", seen.nodes, np.float32, (self._size, 3))
        self._check_array("valid", seen.valid, np.bool_, (self._size,))
        if not np.isfinite(seen.nodes[seen.valid]).all():
            raise self.refused("next", "nodes that are valid and no finite numbers")
        ahead = self.checked("next", seen.taken, float, int) - time.monotonic()
        if not ahead < AHEAD:
            raise self.refused("next", f"a frame that is taken {ahead:.3f} s from now on time.monotonic")
        self.checked("next", seen.doubts, str)
        self._check_raw(self.checked("next", seen.raw, RawFrame))

    def _check_raw(self, raw: RawFrame) -> None:
        count = len(raw.positions) if isinstance(raw.positions, np.ndarray) else 0
        self._check_array("raw.positions", raw.positions, np.float32, (count, 3))
        for name in ("ids", "flags"):
            values = getattr(raw, name)
            size = len(values) if isinstance(values, np.ndarray) else 0
            self._check_array(f"raw.{name}", values, _RAW[name], (size,))
        for name in ("number", "session"):
            if not isinstance(getattr(raw, name), int) or not 0 <= getattr(raw, name) < 2**63:
                raise self.refused("next", f"raw.{name} that is no count: {getattr(raw, name)!r}")
        self.checked("next", raw.delay, float)
        self.checked("next", raw.names, str, type(None))

    def _check_array(self, name: str, values: Any, kind: Any, shape: tuple[int, ...]) -> None:
        if getattr(values, "shape", None) != shape or values.dtype != kind:
            raise self.refused("next", f"{name} that are no {kind.__name__} of shape {shape}")

    def status(self) -> CameraStatus:
        """Return how the stream has gone."""
        found: CameraStatus = self.checked("status", self.called("status"), CameraStatus)
        return found

    def checks(self, seen: Sequence[Sighting]) -> Iterable[Finding]:
        """Return what the device's own checks find."""
        return self.findings(seen)
