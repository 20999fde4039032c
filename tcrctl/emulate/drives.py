"""Drives of an emulated bench, as the rig file describes them."""

from __future__ import annotations

from typing import Final

from tcr_hardware.emulators.plc import PlcEmulator, PlcSettings
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.errors import HardwareError
from tcrctl.emulate.imperfections import Imperfections
from tcrctl.emulate.line import EmulatedDrives
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.emulate.winches import EmulatedWinches
from tcrctl.errors import DeviceError
from tcrctl.plant.rig.settings import CableDrive, Dynamixel, MountedRobot

#: The PLC's limits are wider than the soft limits of the rig file by this [um].
MARGIN: Final = 5000


def emulated_drives(
    mounted: MountedRobot, settings: EmulationSettings, real: Imperfections
) -> EmulatedDrives:
    """Return what moves the cables of a robot, not started yet.

    Args:
        mounted: Section of the rig file.
        settings: Of the emulation.
        real: What is imperfect about the robot.

    Raises:
        DeviceError: If this system has no pseudo-terminals, which motors need.
    """
    plc = mounted.plc
    if isinstance(plc, Dynamixel):
        try:
            axes = tuple(cable.axis for cable in mounted.cables.values())
            servos = () if real.plant.drives is None else real.servos(mounted, max(axes))
            return EmulatedWinches(plc, axes, servos)
        except HardwareError as error:
            raise DeviceError(f"Dynamixel motors cannot be emulated: {error}", hint=error.hint) from error
    return PlcEmulator(_plc_settings(plc.unit, mounted, settings, real))


def _plc_settings(
    unit: int, mounted: MountedRobot, settings: EmulationSettings, real: Imperfections
) -> PlcSettings:
    ranges = [_axis_range(cable) for cable in mounted.cables.values()]
    axes = max(6, *(cable.axis for cable in mounted.cables.values()))
    return PlcSettings(
        axes=axes,
        unit=unit,
        servo=real.servos(mounted, axes),
        limits=PlcLimitSettings(
            min_um=min(low for low, _ in ranges) - MARGIN,
            max_um=max(high for _, high in ranges) + MARGIN,
            watchdog_ms=settings.watchdog_ms,
        ),
    )


def _axis_range(cable: CableDrive) -> tuple[int, int]:
    ends = round(1e3 * cable.sign * cable.min_mm), round(1e3 * cable.sign * cable.max_mm)
    return min(ends), max(ends)
