"""Lag and dead time of the drives, from set-points and what the drives reported.

    set-point s -> dead time D -> dx/dt = (s(t - D) - x) / τ

Between two steps a set-point moves at constant speed, and x follows it exactly; all drives are alike.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from tcrctl.log.reader import Log
from tcrctl.signals import Array

#: Grid on which a dead time falls [s].
STEP: Final = 2e-3
#: Reported lengths this near to the set-points are set-points [m].
SAME: Final = 1e-6
#: Longest lag and dead time looked for [s].
LONGEST: Final = 0.5
#: Starts of the search: lag, dead time [s].
STARTS: Final = ((0.02, 0.0), (0.1, 0.05), (0.1, 0.15))


class DriveAnswer(NamedTuple):
    """How the drives follow their set-points; NaN where it cannot be told.

    Attributes:
        lag: Time constant [s].
        dead_time: Dead time [s].
        error: Root mean square of what is left [m].
    """

    lag: float
    dead_time: float
    error: float


UNKNOWN: Final = DriveAnswer(np.nan, np.nan, np.nan)


def find_answer(log: Log) -> DriveAnswer:
    """Fit lag and dead time to a log; unknown if the drives report their set-points, or do not move."""
    columns = log.columns(("t", "period", "measurement_drive", "applied_drive"))
    return fit_answer(float(columns["period"][0]), columns["applied_drive"], columns["measurement_drive"])


def fit_answer(period: float, applied: Array, reported: Array) -> DriveAnswer:
    """Fit lag and dead time.

    Args:
        period: Control period [s].
        applied: Set-points at the end of every period (k, m) [m].
        reported: Drives at its beginning (k, m) [m].
    """
    asked = np.vstack([reported[:1], applied[:-1]])  # at the instants at which drives are reported
    if np.abs(asked - reported).max() < SAME or np.ptp(asked, axis=0).max() < SAME:
        return UNKNOWN

    from scipy import optimize

    solve: Any = optimize.least_squares  # a module of the same name confuses the type checker

    def left(guess: Array) -> Array:
        return (1e3 * (followed(period, asked, float(guess[0]), float(guess[1])) - reported)).ravel()

    bounds = ([1e-4, 0.0], [LONGEST, LONGEST])
    found = [solve(left, start, bounds=bounds, x_scale=(0.01, 0.01), diff_step=1e-2) for start in STARTS]
    best = min(found, key=lambda result: float(result.cost))
    error = float(np.sqrt(2.0 * best.cost / reported.size))
    return DriveAnswer(float(best.x[0]), float(best.x[1]), 1e-3 * error)


def followed(period: float, asked: Array, lag: float, dead_time: float) -> Array:
    """Return where drives are (k, m) [m] that follow set-points (k, m) [m], one per ``period`` [s]."""
    from scipy import signal

    recursion: Any = signal.lfilter  # type: ignore[attr-defined]  # not known to the type checker
    steps = max(1, round(period / STEP))
    h, keep = period / steps, float(np.exp(-period / steps / lag))
    t = np.arange((asked.shape[0] - 1) * steps + 1) * h - dead_time
    at = np.arange(asked.shape[0]) * period
    fine = np.stack([np.interp(t, at, column) for column in asked.T], axis=1)
    behind = lag * np.diff(fine, axis=0) / h  # exact for a straight line between two instants
    driven = fine[1:] - behind - keep * (fine[:-1] - behind)
    x, _ = recursion([1.0], [1.0, -keep], driven, axis=0, zi=keep * fine[:1])
    return np.vstack([fine[:1], x])[::steps]
