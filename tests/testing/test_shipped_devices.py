"""The shipped cameras and drives keep every promise of their protocols, on their emulators."""

from __future__ import annotations

import pytest

from support.fault_matrix import FEW, WatchedEmulators
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcrctl.plant.rig.assembly import connect_cameras, connect_drives
from tcrctl.plant.rig.mounting import mounting
from tcrctl.testing import CameraBench, CameraConformance, DriveBench, DriveConformance

pytestmark = pytest.mark.slow

#: A busy computer answers late; what is tried here does not depend on it.
LATE = 0.5
NAMES = ("c1", "c2", "c3", "c4")


@pytest.fixture
def emulators(tcr5x4):
    motive = MotiveSettings(command_port=0, rate_hz=50.0)
    with WatchedEmulators(tcr5x4, {}, watchdog_ms=1000, timeout_ms=200, motive_settings=motive) as opened:
        yield opened


class TestNatNetCameras(CameraConformance):
    @pytest.fixture
    def bench(self, emulators, tcr5x4):
        faults, loaded = emulators.motive.faults, emulators.loaded()
        wanted = mounting(loaded.mounted, tcr5x4)
        return CameraBench(
            open=lambda: connect_cameras(loaded, wanted),
            size=wanted.size,
            latency=LATE,
            slack=LATE,
            silence=lambda wrong: setattr(faults, "silent", wrong),
            freeze=lambda wrong: setattr(faults, "freeze", wrong),
            hide=lambda wrong: setattr(faults, "occluded", FEW if wrong else frozenset()),
        )


class TestModbusDrives(DriveConformance):
    @pytest.fixture
    def bench(self, emulators):
        faults, loaded = emulators.plc.faults, emulators.loaded()

        def hook(name):
            return lambda wrong: faults.set(name) if wrong else faults.clear(name)

        return DriveBench(
            open=lambda: connect_drives(loaded, NAMES),
            cables=len(NAMES),
            answer=2 * LATE,
            stop=4 * LATE,
            emulated=True,
            silence=hook("silence"),
            estop=hook("estop"),
        )
