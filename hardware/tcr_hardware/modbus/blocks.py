"""The blocks of the register map as records: what is written, and what the registers read mean."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass

from tcr_hardware.modbus.errors import PlcMismatchError, SetpointError
from tcr_hardware.modbus.registers import MAP_VERSION, Control, Register, RegisterMap, Reject, Status
from tcr_hardware.modbus.status import PlcLimits, PlcSlow, PlcStatus
from tcr_hardware.modbus.words import WordCodec, probe


@dataclass(frozen=True, slots=True)
class Counters:
    """What is counted up with every write.

    Attributes:
        seq: SEQ, changes with every new set of set-points.
        heartbeat: HEARTBEAT, changes with every write.
    """

    seq: int = 0
    heartbeat: int = 0

    @classmethod
    def drawn(cls) -> Counters:
        """Return counters that no other program has, but for one in four thousand million."""
        return cls(secrets.randbelow(1 << 16), secrets.randbelow(1 << 16))

    def next_block(self) -> Counters:
        """Return the counters of the next set of set-points, before it is written."""
        return Counters((self.seq + 1) & 0xFFFF, self.heartbeat)

    def next_write(self) -> Counters:
        """Return the counters of the next write of the same set."""
        return Counters(self.seq, (self.heartbeat + 1) & 0xFFFF)


@dataclass(frozen=True, slots=True)
class Blocks:
    """Translates the blocks of one PLC.

    Attributes:
        map: Its registers.
        codec: Its word and byte order.
    """

    map: RegisterMap
    codec: WordCodec

    def command(
        self, counters: Counters, setpoints_um: Sequence[int], control: Control, vmax_um_s: int
    ) -> list[int]:
        """Return registers of a command block.

        Raises:
            SetpointError: A value does not fit into its register.
        """
        cap = self.map["VMAX"]
        if not vmax_um_s >= cap.scale:
            raise SetpointError("VMAX", vmax_um_s, f"{cap.scale:g} {cap.unit} and more")
        values: dict[str, Sequence[float]] = {
            "CTRL": (int(control),),
            "HEARTBEAT": (counters.heartbeat,),
            "SP": setpoints_um,
            "VMAX": (vmax_um_s // cap.scale * cap.scale,),
            "SEQ": (counters.seq,),
        }
        rows = self.map.block("command")
        return [word for row in rows for word in self.codec.encode(row, values[row.name])]

    def counters(self, words: Sequence[int]) -> Counters:
        """Return the counters that the command block of the PLC holds."""
        values = self._values("command", words)
        return Counters(int(values["SEQ"][0]), int(values["HEARTBEAT"][0]))

    def status(
        self, words: Sequence[int], counters: Counters, now: float, began: float, attempts: int
    ) -> PlcStatus:
        """Return the status block as a record.

        Args:
            words: Its registers.
            counters: What was written last.
            now: When the answer came [s].
            began: When it was asked for [s].
            attempts: How often.
        """
        values = self._values("status", words)
        seq_ack, reject = int(values["SEQ_ACK"][0]), int(values["REJECT"][0])
        return PlcStatus(
            t_s=now,
            seq=counters.seq,
            seq_ack=seq_ack,
            ack_lag=(counters.seq - seq_ack) & 0xFFFF,
            status=Status(int(values["STATUS"][0]) & sum(Status)),
            fault=int(values["FAULT"][0]),
            reject=_reason(reject >> 4),
            reject_axis=reject & 0xF,
            heartbeat_echo=int(values["HB_ECHO"][0]),
            plc_cycle=int(values["PLC_CYCLE"][0]),
            positions_um=_micrometres("ACT", values["ACT"]),
            round_trip_s=now - began,
            attempts=attempts,
        )

    def slow(self, words: Sequence[int]) -> PlcSlow:
        """Return the slow status as a record."""
        values = self._values("slow", words)
        return PlcSlow(_micrometres("SP_ACTIVE", values["SP_ACTIVE"]), values["LOAD"])

    def limits(self, words: Sequence[int]) -> PlcLimits:
        """Return the limits as a record.

        Raises:
            PlcMismatchError: A stroke is empty.
        """
        values = self._values("limits", words)
        lows, highs = _micrometres("MIN", values["MIN"]), _micrometres("MAX", values["MAX"])
        for axis, (lowest, highest) in enumerate(zip(lows, highs, strict=True), start=1):
            if lowest >= highest:
                raise PlcMismatchError(f"MIN, MAX of axis {axis}", f"{lowest}, {highest} um", "MIN below MAX")
        speed, step = (_micrometres(name, values[name])[0] for name in ("VMAX_LIMIT", "STEPMAX"))
        return PlcLimits(int(values["WD_MS"][0]), lows, highs, speed, step)

    def _values(self, block: str, words: Sequence[int]) -> dict[str, tuple[float, ...]]:
        """Return the values of a block by name."""
        return {
            row.name: self.codec.decode(row, _registers(self.map, row, words))
            for row in self.map.block(block)
        }


def identify(rows: RegisterMap, words: Sequence[int], word_order: str, byte_order: str) -> WordCodec:
    """Make sure that a device is a PLC with this map, and find its word and byte order.

    Args:
        rows: The map.
        words: Registers of its slow block.
        word_order: Order expected, or ``auto``.
        byte_order: Order expected, or ``auto``.

    Raises:
        PlcMismatchError: It is not.
    """
    found = probe(_registers(rows, rows["MAGIC"], words)[0], _registers(rows, rows["ORDER_PROBE"], words))
    for name, wanted, seen in (
        ("MAGIC", byte_order, f"{found.byte_order}"),
        ("ORDER_PROBE", word_order, f"{found.word_order}"),
    ):
        if wanted not in ("auto", seen):
            raise PlcMismatchError(
                name, seen, wanted, hint="Set plc.word_order / plc.byte_order in the rig file, or use auto."
            )
    version = rows["MAP_VERSION"]
    number = int(found.decode(version, _registers(rows, version, words))[0])
    if number != MAP_VERSION:
        raise PlcMismatchError("MAP_VERSION", str(number), str(MAP_VERSION))
    return found


def _registers(rows: RegisterMap, row: Register, words: Sequence[int]) -> Sequence[int]:
    """Return registers of one quantity within those of its block."""
    first = rows.span(row.block)[0]
    return words[row.address - first : row.end - first]


def _micrometres(name: str, values: Sequence[float]) -> tuple[int, ...]:
    """Round to whole micrometres.

    Raises:
        PlcMismatchError: A float register holds no finite number.
    """
    try:
        return tuple(round(value) for value in values)
    except (OverflowError, ValueError):
        raise PlcMismatchError(name, str(tuple(values)), "finite numbers") from None


def _reason(code: int) -> Reject:
    """Return the reason of a refusal; a code that only a newer PLC program knows still counts as one."""
    return Reject(code) if code in set(Reject) else Reject.RANGE
