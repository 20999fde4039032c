"""Drives from elsewhere: what they report is checked before it counts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.plant.rig.devices import DeviceLimits, DriveControl, DriveStatus
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.mounting import CableAxis
from tcrctl.plant.rig.own_device import OwnDevice
from tcrctl.plant.rig.settings import DriveSection
from tcrctl.plugins.plugin import Plugin

_MEMBERS: Final = ("identity", "limits", "watchdog", "load", "status", "exchange", "checks", "close")
_BITS: Final = (
    *("enabled", "zeroed", "stopping", "estop", "watchdog", "following_error", "remote"),
    *("acknowledged", "slack"),
)


class OwnDrives(OwnDevice):
    """Drives that a plug-in has built from its settings and the axes of the cables."""

    def __init__(self, settings: DriveSection, plugin: Plugin, cables: tuple[CableAxis, ...]) -> None:
        """Build them.

        Raises:
            DeviceError: If they cannot be reached.
            InputError: If the builder raises anything else, or what it returns are no drives.
        """
        self._cables = len(cables)
        super().__init__(plugin, _MEMBERS, settings, cables)

    @property
    def limits(self) -> DeviceLimits:
        """What they allow by themselves."""
        found = self.told("limits", DeviceLimits)
        low, high = (self._numbers("limits", name, getattr(found, name)) for name in ("low", "high"))
        if not (low < high).all() or not (found.speed > 0 and found.step > 0):
            raise self.refused("limits", "limits that leave no room")
        return DeviceLimits(low, high, float(found.speed), float(found.step))

    @property
    def watchdog(self) -> float | None:
        """Time after which they stop by themselves [s]; None if never."""
        found = self.told("watchdog", float, int, type(None))
        if found is not None and not 0.0 < found < np.inf:
            raise self.refused("watchdog", f"{found} s")
        return None if found is None else float(found)

    def load(self, period: float) -> float:
        """Return the share of a period [s] that an exchange takes."""
        return float(self.checked("load", self.called("load", period), float, int))

    def status(self) -> DriveStatus:
        """Ask how they are."""
        return self._checked_status("status", self.called("status"))

    def exchange(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Send set-points, a copy of them."""
        return self._checked_status("exchange", self.called("exchange", np.array(target), control))

    def checks(self) -> Iterable[Finding]:
        """Return what the device's own checks find."""
        return self.findings()

    def _checked_status(self, name: str, found: Any) -> DriveStatus:
        status: DriveStatus = self.checked(name, found, DriveStatus)
        position = status.position
        if not isinstance(position, np.ndarray) or not np.issubdtype(position.dtype, np.integer):
            raise self.refused(name, "positions that are no array of whole micrometres")
        if position.shape != (self._cables,):
            raise self.refused(name, f"positions of shape {position.shape}, not ({self._cables},)")
        for bit in _BITS:
            self.checked(f"{name}.{bit}", getattr(status, bit), bool, np.bool_)
        for text in ("fault", "reject"):
            self.checked(f"{name}.{text}", getattr(status, text), str)
        if not np.isfinite(self.checked(f"{name}.round_trip", status.round_trip, float, int)):
            raise self.refused(name, "a round trip that is no finite number")
        return replace(status, position=position.astype(np.int64))

    def _numbers(self, name: str, what: str, values: Any) -> NDArray[np.float64]:
        try:
            found = np.array(values, float)
        except (TypeError, ValueError):
            raise self.refused(name, f"{what} that are no numbers") from None
        if found.shape != (self._cables,) or np.isnan(found).any():
            raise self.refused(name, f"{what} that are not {self._cables} numbers")
        return found
