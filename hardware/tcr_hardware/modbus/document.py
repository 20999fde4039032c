"""The register map as a document for the person who programs the PLC.

python -m tcr_hardware.modbus.document > hardware/plc/register_map.md
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum, IntFlag

from tcr_hardware.modbus.registers import (
    MAP_VERSION,
    Control,
    FaultCode,
    Register,
    RegisterMap,
    Reject,
    Status,
    register_map,
)

BLOCKS = {
    "command": "Command: written in one request per control cycle",
    "status": "Fast status: read in every control cycle",
    "slow": "Identity and slow status: read at the start, and on request",
    "limits": "Limits of the PLC: read at the start; the host may be stricter, never looser",
}
CONTROL = {
    Control.ENABLE: "rising edge enables, if `RUN` is set and `READY` is on; 0 stops on a ramp and disables",
    Control.FOLLOW: "take the set-points; without it they are acknowledged and ignored",
    Control.RUN: "run permit; 0 is a controlled stop on a ramp, which also disables",
    Control.RESET: "rising edge clears a latched fault once its cause is gone and everything stands",
    Control.ZERO: "rising edge takes the present positions as zero; ignored while following or moving",
}
STATUS = {
    Status.READY: "an `ENABLE` edge would be obeyed: no fault, zeroed, nothing stopping",
    Status.ZEROED: "the zero of the positions is known",
    Status.ENABLED: "operation is enabled",
    Status.FAULT: "a fault is latched, see `FAULT`",
    Status.ESTOP: "the e-stop is pressed (reported only: the e-stop itself is hard-wired)",
    Status.STOPPING: "the drives are being brought to rest",
    Status.FOLLOWING_ERROR: "a drive was too far from its set-point; latched",
    Status.LIMITED: "the speed cap holds the set-points back",
    Status.WATCHDOG: "the watchdog tripped; latched",
    Status.REMOTE: "the PLC takes commands from this map",
    Status.IN_POSITION: "all drives stand at their set-points",
    Status.SLACK: "a cable is slack",
    Status.DRIVE_COMM: "the field bus to the drives is down, or an encoder tells no position",
}
REJECT = {
    Reject.NONE: "none: the last set was taken",
    Reject.RANGE: "range: outside the stroke",
    Reject.STEP: "step: further from the last accepted set than `STEPMAX`",
    Reject.SPEED: "speed: `VMAX` is 0 or above `VMAX_LIMIT`",
    Reject.NOT_ENABLED: "not enabled",
    Reject.ESTOP: "estop: the e-stop is pressed",
}
FAULT = {
    FaultCode.NONE: "none",
    FaultCode.WATCHDOG: "watchdog: `HEARTBEAT` did not change within `WD_MS` while operation was enabled",
    FaultCode.ESTOP: "estop: the e-stop was pressed",
    FaultCode.FOLLOWING_ERROR: "following error",
    FaultCode.DRIVE: "drive: the field bus to the drives was down, or an encoder told no position",
    FaultCode.CLOCK: "clock: the program measured no time between scans, so the watchdog could not work",
}
RULES = """\
# Register map

Generated from `tcr_hardware/modbus/registers.py` by `python -m tcr_hardware.modbus.document`; do not edit.
Version {version}, {axes} axes. `tcr_plc.st` beside this file is a program that fills this map; the emulator
behaves like it.

Holding registers, addresses from 0 (register 40001 is address 0). 32-bit values take two registers, **high word
first**; bytes within a register as Modbus has them, high byte first. Positions are micrometres of cable taken in
since tension zero; positive pulls.

## Rules

1. The host writes the whole command block once per control cycle with function 23 (write, then read the fast
   status) or with functions 16 and 3. `SEQ` is the last register. The PLC takes the set-points together when `SEQ`
   changes, or none of them; then `SEQ_ACK` becomes `SEQ`, or `REJECT` says why not. The acknowledge may come one
   cycle late.
2. A write that is repeated has the same `SEQ` and another `HEARTBEAT`: it feeds the watchdog and moves nothing.
3. Watchdog: if `HEARTBEAT` does not change for `WD_MS` while operation is enabled, the PLC stops the drives on a
   ramp, holds them, and latches the fault. The same for e-stop, following error and loss of the drives.
4. Nothing starts by itself: after a fault `RESET`, after any stop a new edge of `ENABLE`.
5. The drives hold their position in every state. Letting go of the cables would drop the robot.
6. Set-points are spread evenly over the time between the last two sets (at most 0.1 s), never faster than `VMAX`.
7. After power-up the command block may hold what was written before. In the first scan `ENABLE` and `RESET` do not
   rise, nor does `ZERO` if the zero is known: each has to be seen as 0 first, so nothing is enabled by itself.
8. A host claims the PLC before it enables it: with all bits of `CTRL` 0 it writes a drawn number into `SEQ` and
   another into `HEARTBEAT`, and goes on if both still stand there 0.15 s later. It claims no PLC that is enabled.
9. Only the command block may be written; other writes are answered with exception 2.
"""


def register_map_markdown(rows: RegisterMap) -> str:
    """Write the document of a register map."""
    parts = [RULES.format(version=MAP_VERSION, axes=rows.axes)]
    for block, title in BLOCKS.items():
        first, count = rows.span(block)
        parts.append(f"## {title}\n\nAddresses {first} .. {first + count - 1}, {count} registers.\n")
        parts.append(_table(("address", "name", "type", "unit", "meaning"), map(_row, rows.block(block))))
    for title, meanings in (("CTRL", CONTROL), ("STATUS", STATUS)):
        parts.append(f"## Bits of {title}\n")
        parts.append(_table(("bit", "name", "meaning"), map(_bit, meanings.items())))
    for title, reasons in (("REJECT", REJECT), ("FAULT", FAULT)):
        note = (
            " (in the upper twelve bits; the lower four hold the axis, from 1)" if title == "REJECT" else ""
        )
        parts.append(f"## Values of {title}{note}\n")
        parts.append(_table(("value", "meaning"), map(_value, reasons.items())))
    return "\n".join(parts)


def _row(row: Register) -> tuple[str, ...]:
    """Write one quantity as a row of a table."""
    address = f"{row.address}" if row.words == 1 else f"{row.address} .. {row.end - 1}"
    kind = row.kind if row.count == 1 else f"{row.count} x {row.kind}"
    unit = row.unit if row.scale == 1.0 or not row.unit else f"{row.scale:g} {row.unit}"
    return address, f"`{row.name}`", kind, unit, row.meaning


def _bit(item: tuple[IntFlag, str]) -> tuple[str, ...]:
    bit, meaning = item
    return str(int(bit).bit_length() - 1), f"`{bit.name}`", meaning


def _value(item: tuple[IntEnum, str]) -> tuple[str, ...]:
    value, meaning = item
    return str(int(value)), meaning


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Write a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    print(register_map_markdown(register_map()), end="")
