"""Where the drives are, from what was sent and what they report."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from tcrctl.signals import Array


class DriveBelief:
    """Follows the drives of one robot.

    Attributes:
        reached: Cable taken in now (m,) [m].
        arrived: Set-point of a dead time ago (m,) [m].
        set_point: Set-point sent last (m,) [m].
    """

    def __init__(self, lag: float, dead_time: float, reports: str, period: float) -> None:
        self._keep = math.exp(-period / lag) if lag > 0.0 else 0.0
        self._lag, self._reports, self._period = lag, reports, period
        self._late = dead_time / period
        self._sent: deque[Array] = deque(maxlen=math.ceil(self._late) + 2)
        self.reached = self.arrived = self.set_point = np.zeros(0)

    def update(self, reported: Array, set_point: Array) -> None:
        """Move on by a period, at the end of which the set-point (m,) [m] was to be reached."""
        first = not self._sent
        self._sent.appendleft(set_point.copy())
        before = self.arrived
        self.set_point, self.arrived = self._sent[0], self._ago()
        if first or self._reports == "encoder":
            self.reached = reported.copy()
        elif self._lag == 0.0:
            self.reached = self.arrived
        else:
            rise = self._lag * (self.arrived - before) / self._period
            self.reached = self.arrived - rise + self._keep * (self.reached - before + rise)

    def _ago(self) -> Array:
        """Return the set-point of a dead time ago."""
        i = int(self._late)
        last = len(self._sent) - 1
        a, b = self._sent[min(i, last)], self._sent[min(i + 1, last)]
        return np.asarray(a + (self._late - i) * (b - a))
