"""The lag of drives that report where they are, found by trying.

Every candidate τ predicts the next report from the last one,

    x_k = s_k - r + (x_(k-1) - s_(k-1) + r) e^(-T/τ),    r = τ (s_k - s_(k-1)) / T

exact for a position loop of time constant τ on a set-point s that is a straight line between two control steps. The
one with the least squared error over the last seconds is believed, and 0 as long as nothing has moved.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from tcrctl.signals import Array

#: Candidates [s].
CANDIDATES: Final = np.linspace(0.0, 0.3, 31)
#: Time constant with which errors of the past are forgotten [s].
FORGET_S: Final = 10.0
#: An error of so much for all but the first one says as much as nothing [m].
NOTHING: Final = 2e-6


def follow(reached: Array, before: Array, now: Array, lag: Array, period: float) -> Array:
    """Return where drives are at the end of a period (..., m) [m].

    Args:
        reached: Where they were at its start (m,) [m].
        before: Their set-point then (m,) [m].
        now: Their set-point at its end (m,) [m].
        lag: Time constants (..., 1) [s].
        period: Control period [s].
    """
    with np.errstate(divide="ignore"):
        keep = np.exp(-period / lag)
    rise = lag * (now - before) / period
    return np.asarray(now - rise + keep * (reached - before + rise))


class LagSearch:
    """Searches the lag of one robot's drives.

    Attributes:
        lag: What is believed [s].
    """

    def __init__(self, period: float) -> None:
        """Begin without lag, in control periods of ``period`` [s]."""
        self._period = period
        self._errors = np.where(CANDIDATES > 0.0, NOTHING**2, 0.0)
        self._fade = float(np.exp(-period / FORGET_S))
        self.lag = 0.0

    def observe(self, last: Array, reported: Array, before: Array, now: Array) -> None:
        """Compare two reports (m,) [m] with the set-points (m,) [m] that belonged to them."""
        found = follow(last, before, now, CANDIDATES[:, None], self._period)
        self._errors = self._fade * self._errors + np.sum((found - reported) ** 2, axis=1)
        self.lag = float(CANDIDATES[np.argmin(self._errors)])
