"""Limits that the program of the emulated PLC keeps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PlcLimitSettings:
    """What the program enforces by itself; the defaults are those of ``hardware/plc/tcr_plc.st``.

    Attributes:
        min_um: Lower end of every stroke [um].
        max_um: Upper end of every stroke [um].
        vmax_um_s: Largest speed of the set-points [um/s].
        step_max_um: Largest change of a set-point from one set to the next [um].
        watchdog_ms: Silence after which it stops [ms].
        deceleration_um_s2: Deceleration of a stop [um/s2].
        following_um: Following error that is a fault [um].
    """

    min_um: int = -35_000
    max_um: int = 95_000
    vmax_um_s: int = 100_000
    step_max_um: int = 6_000
    watchdog_ms: int = 200
    deceleration_um_s2: int = 2_000_000
    following_um: int = 8_000
