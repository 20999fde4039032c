"""Arc length over time: rests, cruises and smooth ramps.

A change of speed from v0 to v1 within T follows v0 + (v1 - v0) R(t/T), R(x) = 10 x^3 - 15 x^4 + 6 x^5, the
lowest polynomial with R' = R'' = 0 at both ends: acceleration and jerk begin and end at zero, so the arc
length is three times continuously differentiable over any sequence of phases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array


def ramp(x: Array) -> Array:
    """Return R(x), from 0 at x = 0 to 1 at x = 1 (n,)."""
    return x**3 * (10.0 + x * (6.0 * x - 15.0))


def ramp_integral(x: Array) -> Array:
    """Return the integral of R from 0 to x; 1/2 at x = 1 (n,)."""
    return x**4 * (2.5 + x * (x - 3.0))


def ramp_slope(x: Array) -> Array:
    """Return R'(x); 15/8 at x = 1/2 (n,)."""
    return 30.0 * x**2 * (1.0 - x) ** 2


@dataclass(frozen=True, slots=True)
class Phase:
    """A rest, a cruise or a ramp.

    Attributes:
        duration: How long it takes [s].
        v0: Speed at its start [m/s].
        v1: Speed at its end [m/s].
    """

    duration: float
    v0: float
    v1: float

    @property
    def length(self) -> float:
        """Arc length covered [m]."""
        return 0.5 * (self.v0 + self.v1) * self.duration


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """Arc length over time, as a table of phases.

    Attributes:
        start: Start time of every phase (n,) [s].
        duration: Its duration (n,) [s].
        v0: Speed at its start (n,) [m/s].
        v1: Speed at its end (n,) [m/s].
        s0: Arc length at its start (n,) [m].
    """

    start: Array
    duration: Array
    v0: Array
    v1: Array
    s0: Array

    @classmethod
    def of(cls, phases: Sequence[Phase]) -> TimeLaw:
        """Line up phases, at least one, from time 0 and arc length 0."""
        table = np.array([(p.duration, p.v0, p.v1, p.length) for p in phases])
        begin = np.vstack((np.zeros(4), np.cumsum(table, axis=0)[:-1]))
        return cls(begin[:, 0], table[:, 0], table[:, 1], table[:, 2], begin[:, 3])

    @property
    def total(self) -> float:
        """Duration of all phases together [s]."""
        return float(self.start[-1] + self.duration[-1])

    def arc_length(self, t: Array) -> Array:
        """Return the arc length at times t (n,) [m]; constant before the start and after the end."""
        i, x = self._locate(t)
        v0, change = self.v0[i], self.v1[i] - self.v0[i]
        arc_length: Array = self.s0[i] + self.duration[i] * (v0 * x + change * ramp_integral(x))
        return arc_length

    def speed(self, t: Array) -> Array:
        """Return the speed at times t (n,) [m/s]."""
        i, x = self._locate(t)
        speed: Array = self.v0[i] + (self.v1[i] - self.v0[i]) * ramp(x)
        return speed

    def _locate(self, t: Array) -> tuple[NDArray[np.intp], Array]:
        i = np.clip(np.searchsorted(self.start, t, side="right") - 1, 0, self.start.size - 1)
        return i, np.clip((t - self.start[i]) / self.duration[i], 0.0, 1.0)
