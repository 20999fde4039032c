"""The checks as pytest classes: derive from one, and give it a fixture ``bench``."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tcrctl.testing.bench import CameraBench, DriveBench
from tcrctl.testing.broken import Untried
from tcrctl.testing.camera_checks import CAMERA_CHECKS
from tcrctl.testing.drive_checks import DRIVE_CHECKS


class CameraConformance:
    """Every promise of :class:`tcrctl.plant.rig.devices.Cameras`; the fixture ``bench`` is a CameraBench."""

    @pytest.mark.parametrize("check", CAMERA_CHECKS.values(), ids=CAMERA_CHECKS)
    def test_cameras(self, bench: CameraBench, check: Callable[[CameraBench], None]) -> None:
        """Try one promise."""
        try:
            check(bench)
        except Untried as why:
            pytest.skip(str(why))


class DriveConformance:
    """Every promise of :class:`tcrctl.plant.rig.devices.Drives`; the fixture ``bench`` is a DriveBench."""

    @pytest.mark.parametrize("check", DRIVE_CHECKS.values(), ids=DRIVE_CHECKS)
    def test_drives(self, bench: DriveBench, check: Callable[[DriveBench], None]) -> None:
        """Try one promise."""
        try:
            check(bench)
        except Untried as why:
            pytest.skip(str(why))
