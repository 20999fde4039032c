"""What the PLC reports."""

from __future__ import annotations

from dataclasses import dataclass

from tcr_hardware.modbus.registers import Reject, Status


@dataclass(frozen=True, slots=True)
class PlcStatus:
    """Fast status, read in every exchange.

    Attributes:
        t_s: When the answer came, ``time.monotonic`` [s].
        seq: SEQ sent last.
        seq_ack: SEQ that the PLC accepted last.
        ack_lag: How many blocks the acknowledge is behind; 1 is normal, a PLC answers before its next scan.
        status: Status bits.
        fault: Value of FAULT, normally one of `FaultCode`.
        reject: Why the last set-points were refused.
        reject_axis: Axis that was the reason, from 1; 0 for none.
        heartbeat_echo: HEARTBEAT as seen by the PLC program.
        plc_cycle: Scan counter.
        positions_um: Positions of the drives (axes,) [um].
        round_trip_s: Duration of the successful attempt [s].
        attempts: Attempts that were needed; 1 if all is well.
    """

    t_s: float
    seq: int
    seq_ack: int
    ack_lag: int
    status: Status
    fault: int
    reject: Reject
    reject_axis: int
    heartbeat_echo: int
    plc_cycle: int
    positions_um: tuple[int, ...]
    round_trip_s: float
    attempts: int


@dataclass(frozen=True, slots=True)
class PlcSlow:
    """Slow status, read on request.

    Attributes:
        active_um: Set-points as interpolated and limited by the PLC (axes,) [um].
        load: Tensions or torques (axes,), in the unit of LOAD.
    """

    active_um: tuple[int, ...]
    load: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PlcLimits:
    """Limits that the PLC itself enforces.

    Attributes:
        watchdog_ms: Silence after which it stops by itself [ms].
        min_um: Lower ends of the strokes (axes,) [um].
        max_um: Upper ends (axes,) [um].
        vmax_um_s: Largest speed [um/s].
        step_max_um: Largest change of a set-point from one block to the next [um].
    """

    watchdog_ms: int
    min_um: tuple[int, ...]
    max_um: tuple[int, ...]
    vmax_um_s: int
    step_max_um: int


@dataclass(frozen=True, slots=True)
class PlcInfo:
    """What was found out when the connection was opened.

    Attributes:
        map_version: Version of the register map.
        word_order: ``high_first`` or ``low_first``.
        byte_order: ``big`` or ``little``.
        limits: Limits of the PLC.
        status: Its state then.
    """

    map_version: int
    word_order: str
    byte_order: str
    limits: PlcLimits
    status: PlcStatus


@dataclass(slots=True)
class BusStatistics:
    """Counts since the bus was made.

    Attributes:
        exchanges: Cycles that were asked for.
        retries: Attempts beyond the first.
        timeouts: Attempts without an answer.
        stale_answers: Answers of earlier requests.
        garbled_answers: Answers that could not be read, or confirmed something else.
        reconnects: Connections opened again.
        rejects: Answers in which the PLC had refused set-points.
        round_trip_s: Duration of the last successful attempt [s].
    """

    exchanges: int = 0
    retries: int = 0
    timeouts: int = 0
    stale_answers: int = 0
    garbled_answers: int = 0
    reconnects: int = 0
    rejects: int = 0
    round_trip_s: float = 0.0
