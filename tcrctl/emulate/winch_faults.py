"""What can go wrong with emulated Dynamixel motors, by the names of a fault script."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple, TypeAlias

from tcr_hardware.dynamixel.table import HardwareFault
from tcr_hardware.emulators.dynamixel import DynamixelEmulator
from tcrctl.errors import InputError

Arguments: TypeAlias = Mapping[str, float]
#: So many answers are all that will ever be.
ALL: Final = 10**9


class WinchFault(NamedTuple):
    """How a fault begins, what it may be told, and how it ends; None if it stays."""

    begin: Callable[[DynamixelEmulator, Arguments], None]
    arguments: tuple[str, ...] = ()
    end: Callable[[DynamixelEmulator], None] | None = None


def _be_silent(bus: DynamixelEmulator, given: Arguments) -> None:
    if "axis" in given:
        bus.deaf.add(_motor(bus, given))
    elif "count" in given:
        bus.lost = int(given["count"])
    else:
        bus.silent = True


def _answer(bus: DynamixelEmulator) -> None:
    bus.silent, bus.lost = False, 0
    bus.deaf.clear()


def _garble(bus: DynamixelEmulator, given: Arguments) -> None:
    bus.corrupt = int(given.get("count", ALL))


def _be_late(bus: DynamixelEmulator, given: Arguments) -> None:
    bus.delay = given.get("seconds", 0.1)


def _let_go(bus: DynamixelEmulator) -> None:
    for motor in bus.motors:
        bus.stall(motor, stalled=False)


FAULTS: Final[Mapping[str, WinchFault]] = {
    "silence": WinchFault(_be_silent, ("count", "axis"), _answer),
    "corrupt": WinchFault(_garble, ("count",), lambda bus: _garble(bus, {"count": 0})),
    "delay": WinchFault(_be_late, ("seconds",), lambda bus: _be_late(bus, {"seconds": 0.0})),
    "drive": WinchFault(lambda bus, given: bus.fail(_motor(bus, given), HardwareFault.OVERLOAD), ("axis",)),
    "jam": WinchFault(lambda bus, given: bus.stall(_motor(bus, given)), ("axis",), _let_go),
    "restart": WinchFault(lambda bus, _: bus.restart()),
    "reset": WinchFault(lambda bus, _: bus.unplug()),
}


class WinchFaults:
    """Takes the faults of a script."""

    def __init__(self, bus: DynamixelEmulator) -> None:
        self._bus = bus

    def set(self, name: str, **arguments: float | None) -> None:
        """Let a fault begin.

        Raises:
            InputError: If motors have no such fault, or it does not take an argument.
        """
        if name not in FAULTS:
            raise InputError(f"emulated Dynamixel motors have no fault {name}; they have {', '.join(FAULTS)}")
        fault = FAULTS[name]
        given = {key: value for key, value in arguments.items() if value is not None}
        if strange := sorted(set(given) - set(fault.arguments)):
            known = ", ".join(fault.arguments) or "no arguments"
            raise InputError(f"{name} of emulated Dynamixel motors takes {known}, not {', '.join(strange)}")
        fault.begin(self._bus, given)

    def clear(self, name: str | None = None) -> None:
        """Let a fault end, or all; some stay: motors that have shut down, a line that was pulled out."""
        for each in FAULTS if name is None else (name,):
            if (end := FAULTS[each].end) is not None:
                end(self._bus)


def _motor(bus: DynamixelEmulator, given: Arguments) -> int:
    motor = int(given.get("axis", min(bus.motors)))
    if motor not in bus.motors:
        raise InputError(f"there is no motor {motor}; there are {', '.join(map(str, bus.motors))}")
    return motor
