"""Faults of an emulated PLC, by name, so that a script can switch them on and off."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from tcr_hardware.errors import HardwareError


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault.

    Attributes:
        meaning: What the PLC does while it is set.
        arguments: Names and defaults; None where there is no default but "all" or "for ever".
    """

    meaning: str
    arguments: Mapping[str, float | None] = field(default_factory=dict)


FAULTS: Mapping[str, FaultKind] = MappingProxyType(
    {
        "exception": FaultKind(
            "answers with a Modbus exception", {"code": 4, "function": None, "count": None}
        ),
        "silence": FaultKind("takes no notice of requests", {"count": None}),
        "delay": FaultKind(
            "carries requests out in time, answers late, in order", {"seconds": 0.1, "count": None}
        ),
        "wrong_echo": FaultKind(
            "confirms writes at a wrong address (function 23: reads one register too few)", {"count": None}
        ),
        "corrupt": FaultKind("flips a bit of its answers (RTU: the CRC is wrong)", {"count": None}),
        "truncate": FaultKind("sends half of its answers", {"count": None}),
        "reset": FaultKind("resets its TCP connections, once"),
        "refuse": FaultKind("refuses TCP connections"),
        "word_swap": FaultKind("exchanges the words of all 32-bit registers"),
        "wrong_magic": FaultKind("is another device"),
        "wrong_version": FaultKind("has another version of the map"),
        "freeze_ack": FaultKind("SEQ_ACK stands still"),
        "freeze_heartbeat": FaultKind("HB_ECHO stands still"),
        "freeze_program": FaultKind("the program hangs, Modbus still answers"),
        "estop": FaultKind("the e-stop button is pressed"),
        "drive": FaultKind("the field bus to the drives is down"),
        "jam": FaultKind("the shaft of an axis does not move", {"axis": 1}),
        "encoder": FaultKind("the encoder of an axis tells no position", {"axis": 1}),
        "dead_clock": FaultKind("its program measures no time between scans"),
        "restart": FaultKind("power cycle, once; with keep: 1 the command registers survive", {"keep": 0}),
    }
)


#: What an argument may be: lowest and highest value, and whether it is a whole number.
ARGUMENTS: Mapping[str, tuple[float, float, bool]] = MappingProxyType(
    {
        "axis": (1, 252, True),
        "code": (1, 255, True),
        "count": (1, 10**9, True),
        "function": (1, 127, True),
        "keep": (0, 1, True),
        "seconds": (0, 3600, False),
    }
)


def wrong_argument(name: str, value: float) -> str:
    """Say what is wrong with the value of an argument; empty if nothing is."""
    low, high, whole = ARGUMENTS[name]
    if low <= value <= high and (not whole or value == int(value)):
        return ""
    return f"must be a {'whole ' if whole else ''}number from {low:g} to {high:g}, not {value:g}"


class UnknownFaultError(HardwareError):
    """A fault or argument that does not exist was asked for.

    Attributes:
        name: The name given.
        allowed: The names that exist.
    """

    def __init__(self, name: str, allowed: tuple[str, ...]) -> None:
        super().__init__(f"there is no fault {name!r}; known: {', '.join(allowed) or 'none'}")
        self.name, self.allowed = name, allowed


class PlcFaults:
    """Which faults are set; thread-safe."""

    def __init__(self, on_change: Callable[[str, bool], None]) -> None:
        """Start without faults.

        Args:
            on_change: Called with the name and whether it was set, after every change.
        """
        self._lock, self._on_change = threading.Lock(), on_change
        self._active: dict[str, dict[str, float | None]] = {}

    @property
    def active(self) -> dict[str, dict[str, float | None]]:
        """Arguments of the faults that are set, by name."""
        with self._lock:
            return {name: dict(arguments) for name, arguments in self._active.items()}

    def set(self, name: str, **arguments: float | None) -> None:
        """Switch a fault on.

        Raises:
            UnknownFaultError: There is no such fault, or it has no such argument.
        """
        if name not in FAULTS:
            raise UnknownFaultError(name, tuple(FAULTS))
        for argument in arguments:
            if argument not in FAULTS[name].arguments:
                raise UnknownFaultError(
                    f"{name}.{argument}", tuple(f"{name}.{known}" for known in FAULTS[name].arguments)
                )
        with self._lock:
            self._active[name] = {**FAULTS[name].arguments, **arguments}
        self._on_change(name, True)

    def clear(self, name: str | None = None) -> None:
        """Switch one fault off, or all.

        Raises:
            UnknownFaultError: There is no such fault.
        """
        if name is not None and name not in FAULTS:
            raise UnknownFaultError(name, tuple(FAULTS))
        with self._lock:
            gone = [known for known in self._active if name in (None, known)]
            for known in gone:
                del self._active[known]
        for known in gone:
            self._on_change(known, False)

    def get(self, name: str) -> dict[str, float | None] | None:
        """Return the arguments of a fault if it is set."""
        return self._active.get(name)

    def take(self, name: str) -> dict[str, float | None] | None:
        """Return a fault's arguments if it is set, and use up one answer of one with a ``count``."""
        with self._lock:
            arguments = self._active.get(name)
            if arguments is None:
                return None
            count = arguments.get("count")
            if count is not None:
                if count <= 1:
                    del self._active[name]
                else:
                    arguments["count"] = count - 1
            return dict(arguments)
