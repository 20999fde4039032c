"""Is the PLC program alive? A PLC answers Modbus requests even when its program hangs."""

from __future__ import annotations

from tcr_hardware.modbus.errors import PlcFrozenError, StaleAnswerError
from tcr_hardware.modbus.registers import Reject
from tcr_hardware.modbus.status import PlcStatus

#: A counter counts as frozen when it stood still this often and this long: both, because a fast loop may
#: ask several times within one scan.
FROZEN_ANSWERS, FROZEN_S = 3, 0.1
#: An echo may be this many writes behind before it is taken for an answer of an earlier request.
ECHO_WINDOW = 16


class Liveness:
    """Follows the counters of the PLC from answer to answer."""

    def __init__(self) -> None:
        self._seen: dict[str, tuple[int, int, float]] = {}  # register -> value, repetitions, since when
        self._echo: int | None = None  # of the last answer; a PLC that was just connected may show any

    def check(self, status: PlcStatus, heartbeat: int | None, *, wrote: bool) -> None:
        """Judge one answer.

        Args:
            status: The answer.
            heartbeat: HEARTBEAT written last; None if we never wrote, and what is echoed is of others.
            wrote: Whether this exchange wrote; if not, only the scan counter has to move.

        Raises:
            StaleAnswerError: It is the answer of an earlier request.
            PlcFrozenError: A counter stands still.
        """
        if heartbeat is not None and self._echo not in (None, status.heartbeat_echo):
            behind = (heartbeat - status.heartbeat_echo) & 0xFFFF
            if behind > ECHO_WINDOW or (status.heartbeat_echo - self._echo) & 0xFFFF > 0x8000:
                raise StaleAnswerError("HB_ECHO", heartbeat, status.heartbeat_echo)
        self._echo = status.heartbeat_echo
        self._follow("PLC_CYCLE", status.plc_cycle, status.t_s)
        if wrote:
            self._follow("HB_ECHO", status.heartbeat_echo, status.t_s)
        if status.reject is not Reject.NONE:
            self._seen.pop("SEQ_ACK", None)  # it stands still for a reason that is told
        elif wrote:
            self._follow("SEQ_ACK", status.seq_ack, status.t_s)

    def _follow(self, register: str, value: int, now: float) -> None:
        last, repeated, since = self._seen.get(register, (value, -1, now))
        if value != last:
            repeated, since = -1, now
        self._seen[register] = (value, repeated + 1, since)
        if repeated + 1 >= FROZEN_ANSWERS and now - since >= FROZEN_S:
            raise PlcFrozenError(register, value, now - since)
