"""Dynamixel motors of a rig file with drums on them, as the rest of an emulated bench sees drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tcr_hardware.dynamixel import table
from tcr_hardware.emulators.dynamixel import DynamixelEmulator
from tcr_hardware.modbus.registers import Status
from tcrctl.errors import InputError
from tcrctl.plant.rig.settings import Dynamixel

#: Where the horns stand before the homing offset [counts]: it is not 0, so tension-zero is known.
OFFSET: Final = 100
#: Faults of a script that motors can have.
FAULTS: Final = ("silence", "corrupt", "drive")


class WinchFaults:
    """Takes the faults of a script."""

    def __init__(self, bus: DynamixelEmulator) -> None:
        self._bus = bus

    def set(self, name: str, **arguments: float | None) -> None:
        """Let a fault begin.

        Raises:
            InputError: If motors have no such fault.
        """
        del arguments
        if name not in FAULTS:
            raise InputError(f"emulated Dynamixel motors have no fault {name}; they have {', '.join(FAULTS)}")
        self._change(name, wrong=True)

    def clear(self, name: str | None = None) -> None:
        """Let a fault end, or all; a motor that has shut down stays so."""
        for each in FAULTS if name is None else (name,):
            self._change(each, wrong=False)

    def _change(self, name: str, *, wrong: bool) -> None:
        if name == "silence":
            self._bus.silent = wrong
        elif name == "corrupt":
            self._bus.corrupt = 10**9 if wrong else 0
        elif wrong:
            self._bus.fail(min(self._bus.motors), table.HardwareFault.OVERLOAD)


class EmulatedWinches:
    """The motors of one robot on an emulated bus, zeroed.

    Attributes:
        bus: The bus; a context manager.
        faults: What is wrong with it.
    """

    def __init__(self, settings: Dynamixel, axes: tuple[int, ...]) -> None:
        """Build the bus.

        Args:
            settings: Section of the rig file.
            axes: Numbers of the motors.
        """
        mode = table.Mode.POSITION if settings.current_limit_ma is None else table.Mode.CURRENT_POSITION
        self._start = settings.zero_tick - OFFSET
        self._count = 1e3 * settings.mm_per_turn / table.TURN
        self._axes = axes
        self.bus = DynamixelEmulator(dict.fromkeys(axes, self._start), mode=mode)
        for motor in self.bus.motors.values():
            motor.write(table.HOMING_OFFSET.address, OFFSET.to_bytes(4, "little"))
            motor.write(table.GOAL_POSITION.address, settings.zero_tick.to_bytes(4, "little"))
        self.faults = WinchFaults(self.bus)

    def positions_um(self) -> tuple[float, ...]:
        """Return the cable taken in by every motor (largest number,) [um], 0 where there is none."""
        turns = self.bus.turns()
        numbers = range(1, max(self._axes) + 1)
        return tuple(self._count * (turns.get(n, self._start) - self._start) for n in numbers)

    def set_tensions(self, newtons: object) -> None:
        """Take no notice: these motors are strong."""

    def snapshot(self) -> Mapping[str, object]:
        """Return the state for people, in the words of a PLC."""
        armed = [0 < watchdog < table.TRIPPED for watchdog in self.bus.watchdogs()]
        return {"status": Status.ENABLED if all(armed) else Status(0)}
