"""Where the drives are, from what was sent to them and what they report.

A drive follows the set-point s(t - θ) of a dead time θ ago with a position loop of time constant τ. Drives that
report where they are tell their lag by it; see :mod:`tcrctl.estimator.lag_search`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from tcrctl.estimator.lag_search import LagSearch, follow, lags
from tcrctl.memory import POSITION, Kept
from tcrctl.signals import Array

Reports = Literal["set_point", "encoder"]


class BelievedDrives:
    """Drives of one robot, as far as lag and dead time are known.

    Attributes:
        reached: Where they are (m,) [m].
        arrived: Set-point that they have been told by now (m,) [m].
        set_point: Set-point that was sent last (m,) [m].
        lag: τ [s].
    """

    def __init__(self, lag: float | None, dead_time: float, reports: Reports, period: float) -> None:
        """Take time constant (None: to be found), dead time and control period [s], and what the drives report."""
        self.lag = lag or 0.0
        self._lags = lags(np.array([self.lag]), period)
        self._tell = reports == "encoder"
        self._search = LagSearch(period) if lag is None and self._tell else None
        self._late = dead_time / period
        self._sent = np.zeros((math.ceil(self._late) + 1, 0))
        self.reached = self.arrived = self.set_point = np.zeros(0)

    def sharpen(self) -> None:
        """Search the lag no more: the loop is to be linearised."""
        self._search = None

    def memory(self) -> Mapping[str, Kept]:
        """Return what was sent and has not arrived, and where the drives are if they do not tell.

        The search of the lag is left out; see :meth:`sharpen`.
        """
        sent = {"sent": Kept(self._sent.ravel(), POSITION)} if self._late > 0.0 else {}
        if self._tell or self.lag == 0.0:
            return sent
        return {**sent, "arrived": Kept(self.arrived, POSITION), "reached": Kept(self.reached, POSITION)}

    def update(self, reported: Array, set_point: Array) -> None:
        """Move on by a control period.

        Args:
            reported: What the drives report (m,) [m].
            set_point: Set-point at the end of the period (m,) [m].
        """
        first = self._sent.shape[1] == 0
        if first:
            self._sent = np.tile(set_point, (self._sent.shape[0], 1))
        before, self.set_point = self.arrived, set_point.copy()
        self.arrived = self._told(set_point)
        if self._search is not None and not first:
            self._search.observe(self.reached, reported, before, self.arrived)
            self.lag = self._search.lag
        if first or self._tell:
            self.reached = reported.copy()
        elif self.lag == 0.0:
            self.reached = self.arrived.copy()
        else:
            self.reached = follow(self._lags, self.reached, before, self.arrived)[0]

    def _told(self, set_point: Array) -> Array:
        """Take the set-point that is sent now (m,) [m]; return that of a dead time ago."""
        if self._late == 0.0:
            return set_point.copy()
        self._sent[1:] = self._sent[:-1].copy()
        self._sent[0] = set_point
        i = int(self._late)
        after, before = self._sent[i], self._sent[min(i + 1, len(self._sent) - 1)]
        return np.asarray(after + (self._late - i) * (before - after))
