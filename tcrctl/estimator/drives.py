"""Where the drives are, from what was sent to them and what they report.

A drive follows the set-point s(t - θ) of a dead time θ ago with a position loop of time constant τ. Between two
control steps a set-point is a straight line, so the loop is followed exactly,

    x_k = s_k - r + (x_(k-1) - s_(k-1) + r) e^(-T/τ),    r = τ (s_k - s_(k-1)) / T
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from tcrctl.memory import POSITION, Kept
from tcrctl.signals import Array

Reports = Literal["set_point", "encoder"]


class BelievedDrives:
    """Drives of one robot, as far as lag and dead time are known.

    Attributes:
        reached: Where they are (m,) [m].
        arrived: Set-point that they have been told by now (m,) [m].
        set_point: Set-point that was sent last (m,) [m].
    """

    def __init__(self, lag: float, dead_time: float, reports: Reports, period: float) -> None:
        """Take time constant, dead time and control period [s], and what the drives report."""
        self._lag, self._period = lag, period
        self._keep = math.exp(-period / lag) if lag > 0.0 else 0.0
        self._reports = reports
        self._late = dead_time / period
        self._sent = np.zeros((math.ceil(self._late) + 1, 0))
        self.reached = self.arrived = self.set_point = np.zeros(0)

    def memory(self) -> Mapping[str, Kept]:
        """Return what was sent and has not arrived, and where the drives are if they do not tell."""
        sent = {"sent": Kept(self._sent.ravel(), POSITION)} if self._late > 0.0 else {}
        if self._reports == "encoder" or self._lag == 0.0:
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
        self._sent[1:] = self._sent[:-1].copy()
        self._sent[0] = set_point
        before, self.arrived, self.set_point = self.arrived, self._told(), set_point.copy()
        if first or self._reports == "encoder":
            self.reached = reported.copy()
        elif self._lag == 0.0:
            self.reached = self.arrived.copy()
        else:
            rise = self._lag / self._period * (self.arrived - before)
            self.reached = self.arrived - rise + self._keep * (self.reached - before + rise)

    def _told(self) -> Array:
        """Return the set-point of a dead time ago (m,) [m]."""
        i = int(self._late)
        after, before = self._sent[i], self._sent[min(i + 1, len(self._sent) - 1)]
        return np.asarray(after + (self._late - i) * (before - after))
