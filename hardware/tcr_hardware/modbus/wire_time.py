"""What a serial line can carry: computed before the first cycle, not found out in the middle of a run."""

from __future__ import annotations

import math

from tcr_hardware.modbus.errors import RateError
from tcr_hardware.modbus.settings import BusSettings, RtuLink

# Bytes of request and answer without their registers: unit, function, addresses, counts, CRC.
WRITE_BYTES = 9 + 8
READ_BYTES = 8 + 5
READ_WRITE_BYTES = 13 + 5
#: Above this rate the silence before a frame is fixed ([MSL06], section 2.5.1.1).
FIXED_SILENCE_BAUD, FIXED_SILENCE_S = 19200, 1.75e-3
#: The standard counts eleven bits for a character of the silence.
SILENCE_BITS = 3.5 * 11

#: Part of a control period that the wire may be busy; the rest is for the PLC to answer in.
LARGEST_SHARE = 0.8
#: A watchdog that is not longer than this many periods would trip on a late cycle or two.
WATCHDOG_PERIODS = 3


def silence(link: RtuLink) -> float:
    """Pause that separates two frames [s]."""
    return FIXED_SILENCE_S if link.baud > FIXED_SILENCE_BAUD else SILENCE_BITS / link.baud


def frame_time(link: RtuLink, size: int) -> float:
    """Return the time that a frame of ``size`` bytes takes, with the silence before it [s]."""
    bits = 1 + 8 + (link.parity != "N") + link.stop_bits
    return size * bits / link.baud + silence(link)


def exchange_time(link: RtuLink, written: int, read: int, exchange: str) -> float:
    """Return the time on the wire of one exchange: requests, answers, silences [s].

    Args:
        link: The line.
        written: Registers written.
        read: Registers read.
        exchange: ``fc23`` or ``fc16_fc3``.
    """
    payload = 2 * (written + read)
    size = payload + (READ_WRITE_BYTES if exchange == "fc23" else WRITE_BYTES + READ_BYTES)
    frames = 2 if exchange == "fc23" else 4
    return frame_time(link, size) + (frames - 1) * silence(link)


def share_of_period(settings: BusSettings, watchdog_ms: int, period_s: float) -> float:
    """Return the share of a control period that one exchange takes on the wire; 0 for TCP.

    Args:
        settings: The bus.
        watchdog_ms: Watchdog of the PLC [ms].
        period_s: Control period wanted [s].

    Raises:
        RateError: The period is too short for the line or the time-out, or too long for the watchdog.
    """
    _check_watchdog(settings, 1e-3 * watchdog_ms, period_s)
    if not isinstance(settings.link, RtuLink):
        return 0.0
    exchange = "fc23" if settings.exchange == "fc23" else "fc16_fc3"  # auto may end up with either
    written, read = settings.map.span("command")[1], settings.map.span("status")[1]
    wire_s = exchange_time(settings.link, written, read, exchange)
    shortest_s = wire_s / LARGEST_SHARE
    if period_s < shortest_s:
        raise RateError(
            f"period {1e3 * period_s:g} ms: one exchange takes {1e3 * wire_s:.1f} ms on {settings.link} "
            f"({exchange}), which needs {1e3 * shortest_s:.1f} ms",
            period_s,
            shortest_s,
            hint="Raise the baud rate or the period; exchange: fc23 is shorter, if the PLC has it.",
        )
    if settings.timeout_s <= wire_s:
        raise RateError(
            f"time-out {1e3 * settings.timeout_s:g} ms: one exchange takes {1e3 * wire_s:.1f} ms "
            f"on {settings.link}",
            period_s,
            math.inf,
            hint="Raise the baud rate or the time-out.",
        )
    return wire_s / period_s


def _check_watchdog(settings: BusSettings, watchdog_s: float, period_s: float) -> None:
    """Check that the watchdog outlasts a few cycles, and that a silent PLC is noticed before it trips."""
    if WATCHDOG_PERIODS * period_s > watchdog_s:
        raise RateError(
            f"period {1e3 * period_s:g} ms: the watchdog of the PLC ({1e3 * watchdog_s:g} ms) has to be "
            f"at least {WATCHDOG_PERIODS} periods",
            period_s,
            math.inf,
            hint="Shorten the control period, or lengthen the watchdog in the PLC.",
        )
    silent_s = (settings.retries + 1) * settings.timeout_s
    if silent_s >= watchdog_s:
        raise RateError(
            f"{settings.retries + 1} time-outs of {1e3 * settings.timeout_s:g} ms outlast the watchdog "
            f"of the PLC ({1e3 * watchdog_s:g} ms)",
            period_s,
            math.inf,
            hint="Lower the time-out or the number of retries.",
        )
