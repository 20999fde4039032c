"""The holding registers of the emulated PLC, filled from its program.

The addresses come from the register map that both sides share; the encoding is written here once more, so that a
mistake in the client's does not hide itself.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence

from tcr_hardware.emulators.plc_faults import PlcFaults
from tcr_hardware.modbus.registers import MAGIC, MAP_VERSION, ORDER_PROBE, Register, RegisterMap

Values = Mapping[str, Sequence[float]]
READ_ONLY = ("status", "slow", "limits")


class IllegalAddressError(Exception):
    """A request names registers that do not exist or cannot be written."""


class PlcImage:
    """Registers as a Modbus client sees them."""

    def __init__(
        self, rows: RegisterMap, low_first: bool, faults: PlcFaults, values: Callable[[str], Values]
    ) -> None:
        """Start with all command registers 0.

        Args:
            rows: The register map.
            low_first: Low word first.
            faults: Faults that show in registers.
            values: Values of a read-only block by name, now.
        """
        self._map = rows
        self._low_first = low_first
        self._faults = faults
        self._values = values
        self._first, count = rows.span("command")
        self._command = [0] * count
        self._frozen: dict[str, Sequence[float]] = {}

    def clear(self) -> None:
        """Power up: command registers are 0 again."""
        self._command = [0] * len(self._command)

    def read(self, address: int, count: int) -> list[int]:
        """Read registers (count,) from ``address`` on; gaps within a block read 0.

        Raises:
            IllegalAddressError: A register lies in no block.
        """
        words: dict[int, int] = {}
        for block in ("command", *READ_ONLY):
            first, length = self._map.span(block)
            if first < address + count and address < first + length:
                words |= dict.fromkeys(range(first, first + length), 0) | self._block(block)
        try:
            return [words[at] for at in range(address, address + count)]
        except KeyError:
            raise IllegalAddressError from None

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write command registers.

        Raises:
            IllegalAddressError: A register is no command register; nothing was written.
        """
        start = address - self._first
        if start < 0 or start + len(words) > len(self._command):
            raise IllegalAddressError
        self._command[start : start + len(words)] = words

    def command(self) -> dict[str, list[float]]:
        """Return the values of the command registers by name, as the program reads them."""
        return {row.name: self._decode(row) for row in self._map.block("command")}

    def _block(self, block: str) -> dict[int, int]:
        """Return registers of a block by address."""
        if block == "command":
            return dict(enumerate(self._command, start=self._first))
        values = self._with_faults(self._values(block))
        words: dict[int, int] = {}
        for row in self._map.block(block):
            encoded = [word for value in values[row.name] for word in self._encode(row, value)]
            words |= dict(enumerate(encoded, start=row.address))
        return words

    def _with_faults(self, values: Values) -> Values:
        """Return the values as the faults distort them."""
        shown = dict(values)
        for fault, name in (("freeze_ack", "SEQ_ACK"), ("freeze_heartbeat", "HB_ECHO")):
            if name in shown and self._faults.get(fault) is not None:
                shown[name] = self._frozen.setdefault(name, shown[name])
            elif name in shown:
                self._frozen.pop(name, None)
        if "MAGIC" in shown and self._faults.get("wrong_magic") is not None:
            shown["MAGIC"] = (0xBEEF,)
        if "MAP_VERSION" in shown and self._faults.get("wrong_version") is not None:
            shown["MAP_VERSION"] = (MAP_VERSION + 1,)
        return shown

    def _swapped(self) -> bool:
        return self._low_first != (self._faults.get("word_swap") is not None)

    def _encode(self, row: Register, value: float) -> tuple[int, ...]:
        counts = value / row.scale
        if row.kind == "float32":
            pair = struct.unpack(">HH", struct.pack(">f", counts))
        elif row.kind == "int32":
            pair = struct.unpack(">HH", struct.pack(">i", min(max(round(counts), -(2**31)), 2**31 - 1)))
        else:
            return (round(counts) & 0xFFFF,)
        return pair[::-1] if self._swapped() else pair

    def _decode(self, row: Register) -> list[float]:
        start = row.address - self._first
        raw = struct.pack(f">{row.words}H", *self._command[start : start + row.words])
        if row.kind in ("int32", "float32"):
            if self._swapped():
                raw = b"".join(raw[i + 2 : i + 4] + raw[i : i + 2] for i in range(0, len(raw), 4))
            code = "i" if row.kind == "int32" else "f"
        else:
            code = "H" if row.kind == "u16" else "h"
        return [count * row.scale for count in struct.unpack(f">{row.count}{code}", raw)]


def identity() -> dict[str, tuple[float, ...]]:
    """Return registers by which a client knows this map."""
    return {"MAGIC": (MAGIC,), "MAP_VERSION": (MAP_VERSION,), "ORDER_PROBE": (ORDER_PROBE,)}
