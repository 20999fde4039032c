"""The register map between tcrctl and the PLC, as data; client, emulator and document all come from it.

Holding registers, addresses from 0. One command block is written per control cycle, SEQ last; the PLC
takes the set-points together when SEQ changes. Positions are int32 micrometres: read in the wrong word
order they land far outside every stroke and are refused, where a float32 would read as a harmless-looking 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from itertools import pairwise

from tcr_hardware.modbus.errors import MapError

MAGIC = 0x5443  # "TC"
MAP_VERSION = 1
#: Every byte differs, so that it shows the order of words and of bytes.
ORDER_PROBE = 0x01020304

#: Registers that one item of each kind takes.
WIDTHS = {"u16": 1, "i16": 1, "int32": 2, "float32": 2}
BLOCKS = ("command", "status", "slow", "limits")
MOST_AXES = 12
#: Most registers that one Modbus request may read, and that function 23 may write.
MOST_READ, MOST_WRITTEN = 125, 121


class Control(IntFlag):
    """Bits of CTRL."""

    ENABLE = 1 << 0
    FOLLOW = 1 << 1
    RUN = 1 << 2
    RESET = 1 << 3
    ZERO = 1 << 4


class Status(IntFlag):
    """Bits of STATUS."""

    READY = 1 << 0
    ZEROED = 1 << 1
    ENABLED = 1 << 2
    FAULT = 1 << 3
    ESTOP = 1 << 4
    STOPPING = 1 << 5
    FOLLOWING_ERROR = 1 << 6
    LIMITED = 1 << 7
    WATCHDOG = 1 << 8
    REMOTE = 1 << 9
    IN_POSITION = 1 << 10
    SLACK = 1 << 11
    DRIVE_COMM = 1 << 12


class Reject(IntEnum):
    """Why the last set-points were not taken: upper bits of REJECT; its low four bits hold the axis, from 1."""

    NONE = 0
    RANGE = 1
    STEP = 2
    SPEED = 3
    NOT_ENABLED = 4
    ESTOP = 5


class FaultCode(IntEnum):
    """Values of FAULT: why the PLC stopped by itself."""

    NONE = 0
    WATCHDOG = 1
    ESTOP = 2
    FOLLOWING_ERROR = 3
    DRIVE = 4
    CLOCK = 5


@dataclass(frozen=True, slots=True)
class Register:
    """One named quantity of the map.

    Attributes:
        name: Its name.
        block: Where it belongs: command, status, slow or limits.
        address: First holding register, from 0.
        kind: u16, i16, int32 or float32.
        count: Number of items, one per axis or one.
        unit: Unit of the quantity; empty for a pure number.
        scale: Units per count.
        meaning: What it is.
    """

    name: str
    block: str
    address: int
    kind: str
    count: int
    unit: str
    scale: float
    meaning: str

    @property
    def words(self) -> int:
        """Number of registers it takes."""
        return WIDTHS[self.kind] * self.count

    @property
    def end(self) -> int:
        """Address behind its last register."""
        return self.address + self.words


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """All registers of one PLC.

    Attributes:
        axes: Number of drives.
        registers: In order of blocks and addresses.
    """

    axes: int
    registers: tuple[Register, ...]
    _by_name: dict[str, Register] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_by_name", {register.name: register for register in self.registers})

    def __getitem__(self, name: str) -> Register:
        """Register of a name."""
        return self._by_name[name]

    def block(self, name: str) -> tuple[Register, ...]:
        """Return registers of one block."""
        return tuple(register for register in self.registers if register.block == name)

    def span(self, name: str) -> tuple[int, int]:
        """Return the first address of a block and number of registers from there to its end."""
        block = self.block(name)
        first = min(register.address for register in block)
        return first, max(register.end for register in block) - first


def register_map(axes: int = 6, changes: Mapping[str, Mapping[str, object]] | None = None) -> RegisterMap:
    """Build map version 1, with the changes of a site.

    Args:
        axes: Number of drives, 1 .. 12.
        changes: Per register name, new values for ``address``, ``kind`` or ``scale``, as a rig file gives them.

    Raises:
        MapError: A change cannot be made, or the result is no usable map.
    """
    if isinstance(axes, bool) or not isinstance(axes, int) or not 1 <= axes <= MOST_AXES:
        raise MapError([f"axes: {axes!r} is not a whole number from 1 to {MOST_AXES}"])
    rows = _default_rows(axes)
    problems: list[str] = []
    for name, change in (changes or {}).items():
        if name not in rows:
            problems.append(f"{name}: no such register; known: {', '.join(rows)}")
        elif wrong := _wrong(name, change):
            problems += wrong
        else:
            rows[name] = replace(rows[name], **change)  # type: ignore[arg-type]  # checked by _wrong
    if not problems:
        problems = _unusable(tuple(rows.values()))
    if problems:
        raise MapError(problems)
    ordered = sorted(rows.values(), key=lambda row: (BLOCKS.index(row.block), row.address))
    return RegisterMap(axes, tuple(ordered))


def _default_rows(axes: int) -> dict[str, Register]:
    """Map version 1, in the order of its addresses."""
    slow = 100 + max(20, -(-(6 + 2 * axes) // 20) * 20)  # the next full twenty behind the fast status
    table = (
        ("command", 0, (
            ("CTRL", "u16", 1, "", 1.0, "control bits, see below"),
            ("HEARTBEAT", "u16", 1, "", 1.0, "one more in every write; feeds the watchdog"),
            ("SP", "int32", axes, "um", 1.0, "cable taken in since tension zero; positive pulls"),
            ("VMAX", "u16", 1, "um/s", 100.0, "cap on the speed of all axes"),
            ("SEQ", "u16", 1, "", 1.0, "last register; the set-points are taken together when it changes"),
        )),
        ("status", 100, (
            ("STATUS", "u16", 1, "", 1.0, "status bits, see below"),
            ("FAULT", "u16", 1, "", 1.0, "why the PLC stopped by itself, see below"),
            ("HB_ECHO", "u16", 1, "", 1.0, "HEARTBEAT as last seen by the program"),
            ("SEQ_ACK", "u16", 1, "", 1.0, "SEQ of the block accepted last"),
            ("REJECT", "u16", 1, "", 1.0, "16 x reason + axis (from 1) if the last block was refused, else 0"),
            ("PLC_CYCLE", "u16", 1, "", 1.0, "scan counter"),
            ("ACT", "int32", axes, "um", 1.0, "position of the drives"),
        )),
        ("slow", slow, (
            ("MAGIC", "u16", 1, "", 1.0, f"0x{MAGIC:04X}, checked at open"),
            ("MAP_VERSION", "u16", 1, "", 1.0, f"{MAP_VERSION}, checked at open"),
            ("ORDER_PROBE", "int32", 1, "", 1.0, f"0x{ORDER_PROBE:08X}, shows word and byte order at open"),
            ("SP_ACTIVE", "int32", axes, "um", 1.0, "set-points as interpolated and limited by the PLC"),
            ("LOAD", "i16", axes, "N", 0.1, "cable tension, or motor torque in 0.1 %"),
        )),
        ("limits", 200, (
            ("WD_MS", "u16", 1, "ms", 1.0, "watchdog time"),
            ("LIMITS_SPARE", "u16", 1, "", 1.0, "0; keeps the values below on even addresses"),
            ("MIN", "int32", axes, "um", 1.0, "lower end of the stroke"),
            ("MAX", "int32", axes, "um", 1.0, "upper end of the stroke"),
            ("VMAX_LIMIT", "int32", 1, "um/s", 1.0, "largest speed"),
            ("STEPMAX", "int32", 1, "um", 1.0, "largest change of a set-point from one block to the next"),
        )),
    )  # fmt: skip
    rows: dict[str, Register] = {}
    for block, base, entries in table:
        address = base
        for name, kind, count, unit, scale, meaning in entries:
            rows[name] = Register(name, block, address, kind, count, unit, scale, meaning)
            address = rows[name].end
    return rows


def _wrong(name: str, change: Mapping[str, object]) -> list[str]:
    """Say what is wrong with a change as such."""
    problems = [
        f"{name}.{key}: unknown; allowed: address, kind, scale"
        for key in change
        if key not in ("address", "kind", "scale")
    ]
    address = change.get("address", 0)
    kind = change.get("kind", "u16")
    scale = change.get("scale", 1.0)
    if isinstance(address, bool) or not isinstance(address, int) or not 0 <= address <= 0xFFFF:
        problems.append(f"{name}.address: {address!r} is not a whole number from 0 to 65535")
    if kind not in WIDTHS:
        problems.append(f"{name}.kind: {kind!r}; allowed: {', '.join(WIDTHS)}")
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.0 < scale < float("inf"):
        problems.append(f"{name}.scale: {scale!r} is not a positive number")
    return problems


def _unusable(rows: tuple[Register, ...]) -> list[str]:
    """Say what keeps a map from being usable."""
    ordered = sorted(rows, key=lambda row: row.address)
    problems = [
        f"{lower.name} ({lower.address} .. {lower.end - 1}) overlaps {upper.name} (from {upper.address})"
        for lower, upper in pairwise(ordered)
        if lower.end > upper.address
    ]
    problems += [f"{row.name} ends behind register 65535" for row in rows if row.end > 0x10000]
    command = [row for row in ordered if row.block == "command"]
    if command[-1].name != "SEQ":
        problems.append(f"SEQ has to be the last register of the command block, not {command[-1].name}")
    for block in BLOCKS:
        members = [row for row in ordered if row.block == block]
        span = members[-1].end - members[0].address
        most = MOST_WRITTEN if block == "command" else MOST_READ
        if block == "command" and span != sum(row.words for row in members):
            problems.append("the command block has a gap; it is written as one piece")
        if span > most:
            problems.append(f"the {block} block spans {span} registers, one request holds {most}")
    return problems
