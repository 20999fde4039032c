"""For authors of devices: does one keep what its protocol promises? Needs pytest.

    class TestMyCameras(CameraConformance):
        @pytest.fixture
        def bench(self):
            with MyEmulator() as emulator:
                yield CameraBench(open=lambda: MyCameras(emulator.address), size=33, silence=emulator.set_silent)

Every promise of :mod:`tcrctl.plant.rig.devices` that can be tried is one test. What a bench cannot do (be silenced,
be hidden) is skipped with a word on what to give. ``CAMERA_CHECKS`` and ``DRIVE_CHECKS`` are the checks by name.
"""

from __future__ import annotations

from tcrctl.testing.bench import CameraBench, DriveBench
from tcrctl.testing.broken import BrokenPromiseError, Untried
from tcrctl.testing.camera_checks import CAMERA_CHECKS
from tcrctl.testing.drive_checks import DRIVE_CHECKS
from tcrctl.testing.suites import CameraConformance, DriveConformance

__all__ = [
    "CAMERA_CHECKS",
    "DRIVE_CHECKS",
    "BrokenPromiseError",
    "CameraBench",
    "CameraConformance",
    "DriveBench",
    "DriveConformance",
    "Untried",
]
