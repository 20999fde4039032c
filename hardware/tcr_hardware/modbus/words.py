"""Values to registers and back, in the word and byte order of the PLC."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

from tcr_hardware.modbus.errors import PlcMismatchError, SetpointError
from tcr_hardware.modbus.registers import MAGIC, ORDER_PROBE, Register

RANGES = {"u16": (0, 0xFFFF), "i16": (-0x8000, 0x7FFF), "int32": (-0x80000000, 0x7FFFFFFF)}
LARGEST_FLOAT32 = 3.4e38
WORD_ORDERS = ("high_first", "low_first")
BYTE_ORDERS = ("big", "little")


@dataclass(frozen=True, slots=True)
class WordCodec:
    """How this PLC lays out values in registers.

    Attributes:
        word_order: ``high_first`` (standard here; Siemens) or ``low_first`` (Modicon, Codesys 2).
        byte_order: ``big`` (the Modbus standard) or ``little``: bytes of every register exchanged.
    """

    word_order: str = "high_first"
    byte_order: str = "big"

    def encode(self, register: Register, values: Sequence[float]) -> list[int]:
        """Return registers (words,) that hold the values (count,), given in the unit of the register.

        Raises:
            SetpointError: A value is no finite number or does not fit.
        """
        if len(values) != register.count:
            raise SetpointError(register.name, tuple(values), f"{register.count} values")
        words: list[int] = []
        for value in values:
            words += self._words(register.kind, _raw(register, value))
        return words

    def decode(self, register: Register, words: Sequence[int]) -> tuple[float, ...]:
        """Return the values (count,) in the unit of the register, from its registers (words,)."""
        width = register.words // register.count
        raw = [self._raw(register.kind, words[i : i + width]) for i in range(0, register.words, width)]
        return tuple(raw) if register.scale == 1.0 else tuple(value * register.scale for value in raw)

    def _words(self, kind: str, raw: float) -> list[int]:
        if kind in ("u16", "i16"):
            return [self._bytes(int(raw) & 0xFFFF)]
        bits = struct.unpack(">I", struct.pack(">f", raw))[0] if kind == "float32" else int(raw) & 0xFFFFFFFF
        high, low = self._bytes(bits >> 16), self._bytes(bits & 0xFFFF)
        return [high, low] if self.word_order == "high_first" else [low, high]

    def _raw(self, kind: str, words: Sequence[int]) -> float:
        if kind == "u16":
            return self._bytes(words[0])
        if kind == "i16":
            return (self._bytes(words[0]) ^ 0x8000) - 0x8000
        high, low = words if self.word_order == "high_first" else (words[1], words[0])
        bits = self._bytes(high) << 16 | self._bytes(low)
        if kind == "float32":
            return float(struct.unpack(">f", struct.pack(">I", bits))[0])
        return (bits ^ 0x80000000) - 0x80000000

    def _bytes(self, word: int) -> int:
        return word if self.byte_order == "big" else (word & 0xFF) << 8 | word >> 8


def _raw(register: Register, value: object) -> float:
    """Return the counts of a value."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise SetpointError(register.name, value, "finite numbers")
    counts = float(value) / register.scale
    if register.kind == "float32" and abs(counts) <= LARGEST_FLOAT32:
        return counts
    lowest, highest = RANGES.get(register.kind, (-LARGEST_FLOAT32, LARGEST_FLOAT32))
    counts = round(counts)
    if not lowest <= counts <= highest:
        unit = f" {register.unit}" if register.unit else ""
        raise SetpointError(
            register.name, value, f"{lowest * register.scale:g} .. {highest * register.scale:g}{unit}"
        )
    return counts


def probe(magic: int, pair: Sequence[int]) -> WordCodec:
    """Find a PLC's word and byte order, from its MAGIC register and the two registers of ORDER_PROBE.

    Raises:
        PlcMismatchError: They hold the two constants in no order.
    """
    for byte_order in BYTE_ORDERS:
        for word_order in WORD_ORDERS:
            codec = WordCodec(word_order, byte_order)
            if codec._words("u16", MAGIC) == [magic] and codec._words("int32", ORDER_PROBE) == list(pair):
                return codec
    if magic not in (MAGIC, WordCodec(byte_order="little")._words("u16", MAGIC)[0]):
        raise PlcMismatchError(
            "MAGIC", f"0x{magic:04X}", f"0x{MAGIC:04X}", hint="Is this the right PLC, unit and register map?"
        )
    raise PlcMismatchError(
        "ORDER_PROBE", f"0x{pair[0]:04X} 0x{pair[1]:04X}", f"0x{ORDER_PROBE:08X} in one of the four orders"
    )
