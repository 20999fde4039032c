"""The lag of drives that report where they are, found by trying.

Every candidate τ predicts the next report from the last one,

    x_k = s_k - r + (x_(k-1) - s_(k-1) + r) e^(-T/τ),    r = τ (s_k - s_(k-1)) / T

exact for a position loop of time constant τ on a set-point s that is a straight line between two control steps. The
one with the least squared error over the last seconds is believed, and 0 as long as nothing has moved.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.numerics.kernel import kernel
from tcrctl.signals import Array

#: Candidates [s].
CANDIDATES: Final = np.linspace(0.0, 0.3, 31)
#: Time constant with which errors of the past are forgotten [s].
FORGET_S: Final = 10.0
#: An error of so much for all but the first one says as much as nothing [m].
NOTHING: Final = 2e-6


class Lags(NamedTuple):
    """Time constants that drives may have.

    Attributes:
        lag: τ (n,) [s].
        keep: e^(-T/τ) (n,).
        period: T [s].
    """

    lag: Array
    keep: Array
    period: float


def lags(lag: Array, period: float) -> Lags:
    """Take time constants (n,) and the control period [s]."""
    with np.errstate(divide="ignore"):
        return Lags(lag, np.exp(-period / lag), period)


@kernel(error_model="numpy")
def follow(lags: Lags, reached: Array, before: Array, now: Array) -> Array:
    """Return where drives of every time constant are at the end of a period (n, m) [m].

    Args:
        lags: Time constants.
        reached: Where they were at its start (m,) [m].
        before: Their set-point then (m,) [m].
        now: Their set-point at its end (m,) [m].
    """
    found = np.empty((lags.lag.shape[0], now.shape[0]))
    for i in range(found.shape[0]):
        for c in range(found.shape[1]):
            rise = lags.lag[i] * (now[c] - before[c]) / lags.period
            found[i, c] = now[c] - rise + lags.keep[i] * (reached[c] - before[c] + rise)
    return found


@kernel(error_model="numpy")
def _best(
    lags: Lags, errors: Array, fade: float, last: Array, reported: Array, before: Array, now: Array
) -> float:
    """Let errors (n,) [m2] fade, add those against a report (m,) [m]; return the lag of the least one [s]."""
    found, best = follow(lags, last, before, now), 0
    for i in range(found.shape[0]):
        error = 0.0
        for c in range(found.shape[1]):
            error += (found[i, c] - reported[c]) ** 2
        errors[i] = fade * errors[i] + error
        if errors[i] < errors[best]:
            best = i
    return float(lags.lag[best])


class LagSearch:
    """Searches the lag of one robot's drives.

    Attributes:
        lag: What is believed [s].
    """

    def __init__(self, period: float) -> None:
        """Begin without lag, in control periods of ``period`` [s]."""
        self._candidates = lags(CANDIDATES, period)
        self._errors = np.where(CANDIDATES > 0.0, NOTHING**2, 0.0)
        self._fade = float(np.exp(-period / FORGET_S))
        self.lag = 0.0

    def observe(self, last: Array, reported: Array, before: Array, now: Array) -> None:
        """Compare two reports (m,) [m] with the set-points (m,) [m] that belonged to them."""
        self.lag = _best(self._candidates, self._errors, self._fade, last, reported, before, now)
