"""The shipped cameras and drives keep every promise of their protocols, on their emulators."""

from __future__ import annotations

import pytest

from support.fault_matrix import FEW, WatchedEmulators
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcr_hardware.emulators.plc import PlcEmulator, PlcSettings
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcrctl.plant.rig.assembly import connect_cameras, connect_drives
from tcrctl.plant.rig.modbus_drives import ModbusDrives
from tcrctl.plant.rig.mounting import CableAxis, mounting
from tcrctl.plant.rig.settings import ModbusRtu
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


def drive_bench(plc, open_drives):
    def hook(name):
        return lambda wrong: plc.faults.set(name) if wrong else plc.faults.clear(name)

    return DriveBench(
        open=open_drives,
        cables=len(NAMES),
        answer=2 * LATE,
        stop=4 * LATE,
        emulated=True,
        silence=hook("silence"),
        estop=hook("estop"),
    )


class TestModbusTcpDrives(DriveConformance):
    @pytest.fixture
    def bench(self, emulators):
        loaded = emulators.loaded()
        return drive_bench(emulators.plc, lambda: connect_drives(loaded, NAMES))


class TestModbusRtuDrives(DriveConformance):
    """Over a pseudo-terminal; the second axis counts the other way."""

    @pytest.fixture
    def bench(self):
        limits = PlcLimitSettings(min_um=-25_000, max_um=25_000, watchdog_ms=1000)
        plc = PlcEmulator(PlcSettings(limits=limits))
        plc.start(tcp=None, rtu="pty")
        line = ModbusRtu(kind="modbus_rtu", device=plc.device, timeout_ms=200.0)
        cables = [
            CableAxis(name, i, -1 if i == 2 else 1, -20_000, 20_000, 5e4) for i, name in enumerate(NAMES, 1)
        ]
        yield drive_bench(plc, lambda: ModbusDrives(line, tuple(cables)))
        plc.stop()
