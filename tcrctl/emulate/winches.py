"""Dynamixel motors of a rig file with drums on them, as the rest of an emulated bench sees drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tcr_hardware.dynamixel import table
from tcr_hardware.emulators.dynamixel import DynamixelEmulator
from tcr_hardware.modbus.registers import Status
from tcr_hardware.servo import ServoSettings, in_unit
from tcrctl.emulate.winch_faults import WinchFaults
from tcrctl.plant.rig.settings import Dynamixel

#: Where the horns stand before the homing offset [counts]: it is not 0, so tension-zero is known.
OFFSET: Final = 100


class EmulatedWinches:
    """The motors of one robot on an emulated bus, zeroed.

    Attributes:
        bus: The bus; a context manager.
        faults: What is wrong with it.
    """

    def __init__(
        self, settings: Dynamixel, axes: tuple[int, ...], servos: tuple[ServoSettings, ...] = ()
    ) -> None:
        """Build the bus.

        Args:
            settings: Section of the rig file.
            axes: Numbers of the motors.
            servos: How imperfect the drives are, the one with number 1 first; ideal if left out.
        """
        mode = table.Mode.POSITION if settings.current_limit_ma is None else table.Mode.CURRENT_POSITION
        self._start = settings.zero_tick - OFFSET
        self._count = 1e3 * settings.mm_per_turn / table.TURN
        self._axes = axes
        loops = {axis: in_unit(servos[axis - 1], self._count) for axis in axes} if servos else None
        self.bus = DynamixelEmulator(dict.fromkeys(axes, self._start), mode=mode, servos=loops)
        for motor in self.bus.motors.values():
            motor.write(table.HOMING_OFFSET.address, OFFSET.to_bytes(4, "little"))
            motor.write(table.GOAL_POSITION.address, settings.zero_tick.to_bytes(4, "little"))
        self.faults = WinchFaults(self.bus)

    def positions_um(self) -> tuple[float, ...]:
        """Return the cable taken in by every motor (largest number,) [um], 0 where there is none."""
        wound = self.bus.wound()
        return tuple(self._count * wound.get(number, 0.0) for number in range(1, max(self._axes) + 1))

    def set_tensions(self, newtons: object) -> None:
        """Take no notice: these motors are strong."""

    def snapshot(self) -> Mapping[str, object]:
        """Return the state for people, in the words of a PLC."""
        armed = [0 < watchdog < table.TRIPPED for watchdog in self.bus.watchdogs()]
        return {"status": Status.ENABLED if all(armed) else Status(0)}
