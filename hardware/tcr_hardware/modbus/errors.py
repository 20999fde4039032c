"""What can go wrong between tcrctl and the PLC, each with its evidence."""

from __future__ import annotations

from tcr_hardware.errors import HardwareError

#: [MAP12], section 7.
EXCEPTION_NAMES = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "server device failure",
    5: "acknowledge",
    6: "server device busy",
    8: "memory parity error",
    10: "gateway path unavailable",
    11: "gateway target device failed to respond",
}


class MapError(HardwareError):
    """A register map cannot be used; the message lists every problem.

    Attributes:
        problems: One line each.
    """

    def __init__(self, problems: list[str]) -> None:
        super().__init__("register map: " + "; ".join(problems))
        self.problems = tuple(problems)


class RateError(HardwareError):
    """The wanted control period cannot be kept on this connection.

    Attributes:
        period_s: Period wanted [s].
        shortest_s: Shortest period that would do [s]; infinite if none does with these settings.
    """

    def __init__(self, message: str, period_s: float, shortest_s: float, *, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.period_s, self.shortest_s = period_s, shortest_s


class SetpointError(HardwareError):
    """A value cannot be written into its register; nothing was sent.

    Attributes:
        register: Name of the register.
        value: The value.
    """

    def __init__(self, register: str, value: object, allowed: str) -> None:
        super().__init__(f"{register}: {value!r} cannot be sent; allowed: {allowed}")
        self.register, self.value = register, value


class PlcMismatchError(HardwareError):
    """The device does not answer as a PLC with this register map would; it must not be armed.

    Attributes:
        register: Name of the register that gave it away.
        found: What was read.
        expected: What the map says.
    """

    def __init__(self, register: str, found: str, expected: str, *, hint: str = "") -> None:
        super().__init__(f"{register} reads {found}, expected {expected}", hint=hint)
        self.register = register
        self.found = found
        self.expected = expected


class LinkError(HardwareError):
    """The connection failed; whether the last command arrived is unknown."""


class LinkLostError(LinkError):
    """No connection: refused, reset, or the serial device is gone."""


class LinkTimeoutError(LinkError):
    """No answer in time.

    Attributes:
        waited_s: How long was waited for this answer [s].
    """

    def __init__(self, message: str, waited_s: float, *, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.waited_s = waited_s


class GarbledAnswerError(LinkError):
    """An answer came that is no valid Modbus answer to the request."""


class WrongEchoError(LinkError):
    """The PLC confirmed a write to another place than was asked for.

    Attributes:
        sent: (address, count) of the request.
        echoed: (address, count) of the answer.
    """

    def __init__(self, sent: tuple[int, int], echoed: tuple[int, int]) -> None:
        super().__init__(
            f"wrote {sent[1]} registers at {sent[0]}, the PLC confirms {echoed[1]} at {echoed[0]}"
        )
        self.sent, self.echoed = sent, echoed


class StaleAnswerError(LinkError):
    """The answer belongs to an earlier request (serial lines have no transaction number), or another master writes.

    Attributes:
        register: Name of the register that gave it away.
        sent: Value sent last.
        echoed: Value the answer holds.
    """

    def __init__(self, register: str, sent: int, echoed: int) -> None:
        super().__init__(
            f"{register} echoes {echoed}, sent last was {sent}: an answer of an earlier request, "
            "or another master writes to this PLC"
        )
        self.register = register
        self.sent = sent
        self.echoed = echoed


class PlcTakenError(HardwareError):
    """Another program writes to the PLC; two would move one robot.

    Attributes:
        evidence: What gave it away.
    """

    def __init__(self, evidence: str) -> None:
        super().__init__(
            f"another program writes to the PLC: {evidence}",
            hint="One program may move a robot: end the other one.",
        )
        self.evidence = evidence


class PlcExceptionError(HardwareError):
    """The PLC refused a request with a Modbus exception.

    Attributes:
        code: Exception code.
        name: Its name in the standard.
        function: Function code of the request.
    """

    def __init__(self, code: int, function: int, what: str) -> None:
        name = EXCEPTION_NAMES.get(code, "unknown code")
        super().__init__(f"the PLC refused to {what}: exception {code} ({name}), function {function}")
        self.code = code
        self.name = name
        self.function = function


class PlcFrozenError(HardwareError):
    """A counter of the PLC stands still although the PLC answers: its program does not run.

    Attributes:
        register: Name of the counter.
        value: Where it stands.
        age_s: Since when [s].
    """

    def __init__(self, register: str, value: int, age_s: float) -> None:
        super().__init__(
            f"{register} stands at {value} for {1e3 * age_s:.0f} ms: the PLC program does not run"
        )
        self.register = register
        self.value = value
        self.age_s = age_s


class ImplausibleAnswerError(HardwareError):
    """A position was reported that the drive cannot have, for instance after the word order changed.

    Attributes:
        axis: Number of the axis, from 1.
        value_um: Position read [um].
        limits_um: Stroke of this axis [um].
    """

    def __init__(self, axis: int, value_um: int, limits_um: tuple[int, int]) -> None:
        super().__init__(
            f"axis {axis} reports {value_um} um, its stroke is {limits_um[0]} .. {limits_um[1]} um",
            hint="Has the word order of the PLC changed?",
        )
        self.axis = axis
        self.value_um = value_um
        self.limits_um = limits_um
