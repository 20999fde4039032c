"""For work on the drives alone: cameras that are always content."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from tcrctl.plant.rig.devices import CameraStatus, Identity, Sighting
from tcrctl.plant.rig.finding import Finding
from tcrctl.signals import RawFrame


class WithoutCameras:
    """Nothing is seen, and nothing has to be: the operator looks."""

    identity = Identity("cameras", "no cameras")
    rate = 1000.0
    clock = ""

    def next(self, timeout: float, *, fresh: bool) -> Sighting | None:
        """Return a frame without markers, taken now."""
        del timeout, fresh
        none = RawFrame(0, 0, 0.0, np.zeros(0, np.int32), np.zeros((0, 3), np.float32), np.zeros(0, np.int32))
        return Sighting(time.monotonic(), np.zeros((0, 3), np.float32), np.zeros(0, np.bool_), "", none)

    def status(self) -> CameraStatus:
        """Return zeros."""
        return CameraStatus()

    def checks(self, seen: Sequence[Sighting]) -> tuple[Finding, ...]:
        """Find nothing."""
        del seen
        return ()

    def close(self) -> None:
        """Do nothing: there is nothing to close."""
