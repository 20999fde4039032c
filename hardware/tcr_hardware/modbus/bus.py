"""One exchange per control cycle with the PLC: set-points and heartbeat out, state and positions back.

                SEQ + 1, HEARTBEAT + 1        the PLC takes the set when SEQ changes
    set-points --> command block --> FC23 or FC16, FC3 --> status block --> echo and position checks --> PlcStatus

A failed exchange is repeated with the same SEQ, so that the PLC takes each set of set-points once at most.

One program writes to a PLC. It claims it by drawn numbers in SEQ and HEARTBEAT that must still stand there after a
while, as in Fischer's mutual exclusion: of several that begin at once the last to write is the one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from tcr_hardware.modbus.blocks import Blocks, Counters, identify
from tcr_hardware.modbus.errors import (
    GarbledAnswerError,
    ImplausibleAnswerError,
    LinkError,
    LinkLostError,
    LinkTimeoutError,
    MapError,
    PlcExceptionError,
    PlcMismatchError,
    PlcTakenError,
    StaleAnswerError,
    WrongEchoError,
)
from tcr_hardware.modbus.link import Dial, ModbusLink
from tcr_hardware.modbus.liveness import Liveness
from tcr_hardware.modbus.registers import MAP_VERSION, Control, Reject, Status
from tcr_hardware.modbus.settings import EXCHANGES, BusSettings
from tcr_hardware.modbus.status import BusStatistics, PlcInfo, PlcSlow, PlcStatus
from tcr_hardware.modbus.wire_time import share_of_period
from tcr_hardware.modbus.words import BYTE_ORDERS, WORD_ORDERS, WordCodec

ILLEGAL_FUNCTION = 1
#: How long an answer may take while the bus is opened and nothing moves [s].
OPENING_S = 0.5
#: A PLC that was restarted has seen the last write after this time [s]: one cycle of its program.
SCAN_S = 0.01

#: A claim has to stand for so long [s]: longer than any program needs from finding a PLC free to its own claim.
CLAIM_S = 0.15

T = TypeVar("T")


class PlcBus:
    """A PLC that moves the cable drives; one owner, not thread-safe.

    Attributes:
        statistics: Counts since the bus was made.
    """

    def __init__(self, settings: BusSettings, dial: Dial | None = None) -> None:
        """Prepare the bus; nothing is opened yet.

        Args:
            settings: The PLC.
            dial: Opens something else than the network or the serial line; see :class:`ModbusLink`.

        Raises:
            MapError: A setting is not one of those allowed.
        """
        for name, value, allowed in (
            ("exchange", settings.exchange, EXCHANGES),
            ("word_order", settings.word_order, ("auto", *WORD_ORDERS)),
            ("byte_order", settings.byte_order, ("auto", *BYTE_ORDERS)),
        ):
            if value not in allowed:
                raise MapError([f"{name}: {value!r}; allowed: {', '.join(allowed)}"])
        self._settings, self._map = settings, settings.map
        probe = self._map["MAGIC"].address
        self._link = ModbusLink(settings.link, settings.unit, settings.timeout_s, probe, dial)
        self._one_request = settings.exchange != "fc16_fc3"
        self._blocks = Blocks(self._map, WordCodec())
        self._counters = Counters()
        self._liveness = Liveness()
        self._info: PlcInfo | None = None
        self._wrote = False
        self._is_open = False  # stays so while a lost connection waits for its next attempt
        self.statistics = BusStatistics()

    def __enter__(self) -> PlcBus:
        """Open the bus."""
        self.open()
        return self

    def __exit__(self, *exception: object) -> None:
        """Close it."""
        self.close()

    @property
    def info(self) -> PlcInfo:
        """What `open` found out.

        Raises:
            LinkLostError: The bus was never opened.
        """
        if self._info is None:
            raise LinkLostError("the bus to the PLC is not open")
        return self._info

    def open(self) -> PlcInfo:
        """Connect, make sure that this is the right PLC, and read its limits and state; writes nothing.

        Raises:
            LinkError: No connection or no valid answer.
            PlcExceptionError: The PLC does not know the registers.
            PlcMismatchError: It is not the PLC of this register map.
        """
        self.close()
        with self._link.patience(OPENING_S, max(1, self._settings.retries)):
            self._link.open()
            try:
                self._info = self._find_out()
            except BaseException:
                self._link.close()
                raise
        self._is_open = True
        return self._info

    def _find_out(self) -> PlcInfo:
        """Read everything that a bus has to know of its PLC."""
        codec = self._identify()
        self._blocks, self._liveness = Blocks(self._map, codec), Liveness()
        limits = self._blocks.limits(self._read("limits"))
        self._counters, self._wrote = self._blocks.counters(self._read("command")), False
        status = self._status(self._read("status"), time.monotonic(), 1)
        return PlcInfo(MAP_VERSION, codec.word_order, codec.byte_order, limits, status)

    def close(self) -> None:
        """Close the connection; sends nothing. Never raises."""
        self._is_open = False
        self._link.close()

    def check_period(self, period_s: float) -> float:
        """Return the share of a control period that one exchange takes on the wire; 0 for TCP. Needs an open bus.

        Raises:
            RateError: The period is too short for the line, or for the watchdog of the PLC.
        """
        return share_of_period(self._settings, self.info.limits.watchdog_ms, period_s)

    def claim(self, setpoints_um: Sequence[int], vmax_um_s: int) -> None:
        """Become the only one that writes, with control bits 0; takes ``CLAIM_S``. Nothing moves.

        Args:
            setpoints_um: Where the axes are (axes,) [um].
            vmax_um_s: As in `exchange`.

        Raises:
            PlcTakenError: Another program has enabled the PLC, or writes to it too; at most one block was written.
            LinkError: No valid answer.
        """
        self._liveness = Liveness()  # whatever HEARTBEAT others have written
        if Status.ENABLED in self.read_status().status:
            raise PlcTakenError("the drives are enabled")
        self._counters = mine = Counters.drawn()
        self._persist(
            lambda attempt: self._send(self._blocks.command(mine, setpoints_um, Control(0), vmax_um_s))
        )
        time.sleep(CLAIM_S)
        found = self._persist(lambda attempt: self._blocks.counters(self._read("command")))
        if found != mine:
            raise PlcTakenError(f"SEQ is {found.seq}, written was {mine.seq}")
        self._liveness = Liveness()

    def exchange(self, setpoints_um: Sequence[int], control: Control, vmax_um_s: int) -> PlcStatus:
        """Send one set of set-points and get the state of the PLC.

        Args:
            setpoints_um: One per axis (axes,) [um]; taken by the PLC only with ENABLE and FOLLOW.
            control: Control bits.
            vmax_um_s: Speed cap for the PLC [um/s], rounded down to the resolution of VMAX.

        Raises:
            SetpointError: A value does not fit; nothing was sent.
            LinkError: No valid answer, also not after the retries.
            PlcExceptionError: The PLC refused.
            PlcFrozenError: The PLC answers but its program does not run.
            ImplausibleAnswerError: A position far outside its stroke was reported.
        """
        counters = self._counters.next_block()
        self._blocks.command(counters, setpoints_um, control, vmax_um_s)  # a bad value stops here
        self._counters = counters
        self.statistics.exchanges += 1
        return self._persist(lambda attempt: self._cycle(setpoints_um, control, vmax_um_s, attempt))

    def read_status(self) -> PlcStatus:
        """Read the state without writing anything; the watchdog is not fed. Errors as in `exchange`."""
        return self._persist(self._look)

    def read_slow(self) -> PlcSlow:
        """Read the slow status. Errors as in `exchange`."""
        return self._blocks.slow(self._persist(lambda attempt: self._read("slow")))

    def _cycle(
        self, setpoints_um: Sequence[int], control: Control, vmax_um_s: int, attempt: int
    ) -> PlcStatus:
        """Attempt an exchange once."""
        self._counters = self._counters.next_write()
        block = self._blocks.command(self._counters, setpoints_um, control, vmax_um_s)
        began = time.monotonic()
        return self._judged(self._status(self._send(block), began, attempt), wrote=True)

    def _look(self, attempt: int) -> PlcStatus:
        """Attempt to read the state once."""
        began = time.monotonic()
        return self._judged(self._status(self._read("status"), began, attempt), wrote=False)

    def _send(self, block: list[int]) -> list[int]:
        """Write the command block and read the status block."""
        address, (read_address, count) = self._map.span("command")[0], self._map.span("status")
        self._wrote = True
        if self._one_request:
            try:
                return self._link.read_write(read_address, count, address, block)
            except PlcExceptionError as error:
                if error.code != ILLEGAL_FUNCTION or self._settings.exchange == "fc23":
                    raise
                self._one_request = False  # not every PLC has function 23; nothing was written
        self._link.write(address, block)
        return self._link.read(read_address, count)

    def _persist(self, attempt: Callable[[int], T]) -> T:
        """Try again after a failure of the link, as often and as long as the settings allow."""
        retries, number = self._settings.retries, 1
        last_start = time.monotonic() + (retries + 0.5) * self._settings.timeout_s
        while True:
            try:
                if not self._link.connected:
                    self._reconnect()
                return attempt(number)
            except LinkError as error:
                self._count(error)
                if number > retries or time.monotonic() > last_start:
                    raise
                if isinstance(error, StaleAnswerError):
                    self._link.distrust()
                    time.sleep(SCAN_S)
            number += 1
            self.statistics.retries += 1

    def _reconnect(self) -> None:
        """Open the connection again; before anything is written, the PLC has to be the same one."""
        codec = self._blocks.codec
        if not self._is_open:
            raise LinkLostError("the bus to the PLC is not open")
        self._link.open()
        self._liveness = Liveness()
        self.statistics.reconnects += 1
        try:
            if (found := self._identify()) != codec:
                raise PlcMismatchError("ORDER_PROBE", found.word_order, codec.word_order)
        except BaseException:
            self._link.close()  # or the next exchange would write to a PLC that nobody has identified
            raise

    def _identify(self) -> WordCodec:
        """Return the word and byte order of the PLC."""
        return identify(self._map, self._read("slow"), self._settings.word_order, self._settings.byte_order)

    def _read(self, block: str) -> list[int]:
        return self._link.read(*self._map.span(block))

    def _status(self, words: list[int], began: float, attempt: int) -> PlcStatus:
        return self._blocks.status(words, self._counters, time.monotonic(), began, attempt)

    def _judged(self, status: PlcStatus, *, wrote: bool) -> PlcStatus:
        """Return an answer if it can be true."""
        limits = self.info.limits
        strokes = zip(limits.min_um, limits.max_um, strict=True)
        for axis, (at, (lowest, highest)) in enumerate(zip(status.positions_um, strokes, strict=True), 1):
            if not 2 * lowest - highest <= at <= 2 * highest - lowest:  # a full stroke beyond the ends
                raise ImplausibleAnswerError(axis, at, (lowest, highest))
        self._liveness.check(status, self._counters.heartbeat if self._wrote else None, wrote=wrote)
        self.statistics.round_trip_s = status.round_trip_s
        self.statistics.rejects += status.reject is not Reject.NONE
        return status

    def _count(self, error: LinkError) -> None:
        self.statistics.timeouts += isinstance(error, LinkTimeoutError)
        self.statistics.stale_answers += isinstance(error, StaleAnswerError)
        self.statistics.garbled_answers += isinstance(error, GarbledAnswerError | WrongEchoError)
