"""Markers that cameras lose for a moment, filled in where they must be.

Every marker sits about a millimetre beside its node. A ring that loses one of three for a frame would seem to jump
by that, and the end normal with it; a ring that is lost whole would let go of all that a wrong model has stored in
the module above. So a lost marker is filled in, where its neighbours carry it (``carried_rings``).

Nothing of the model is needed for that. What the model would say of the next frame is its speed, a difference of
two frames: with a dither of four frames a wave it points beyond every turn.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from tcrctl.estimator.carried_rings import carry
from tcrctl.robot.module import RING
from tcrctl.signals import Measurement

#: A lost marker is filled in for so long [s]; then it counts as not seen. A ring that is lost whole begins anew.
LONGEST: Final = 0.5


class LostMarkers:
    """Remembers the last place of every marker; a frame with all markers passes as it is."""

    def __init__(self, count: int, period: float) -> None:
        """Take the number of markers and the control period [s]."""
        self._period = period
        self._missing, self._rings_missing = np.zeros(count), np.zeros(count // RING)
        self._known = np.zeros(count, dtype=np.bool_)
        self._places = np.zeros((count, 3))

    def filled(self, measured: Measurement) -> Measurement:
        """Return the frame with markers filled in that were lost a moment ago."""
        seen = measured.valid
        if np.count_nonzero(seen) == seen.size:
            self._missing[:] = self._rings_missing[:] = 0.0
            self._places[:], self._known[:] = measured.nodes, True
            return measured
        self._missing = np.where(seen, 0.0, self._missing + self._period)
        places = measured.nodes.astype(np.float64)
        carry(self._places, places, seen, self._known)
        self._places, self._known = places, self._known | seen
        ring_seen = seen.reshape(-1, RING).any(axis=1)
        self._rings_missing = np.where(ring_seen, 0.0, self._rings_missing + self._period)
        since = np.where(np.repeat(ring_seen, RING), self._missing, np.repeat(self._rings_missing, RING))
        fill = ~seen & (since < LONGEST) & self._known
        if not fill.any():
            return measured
        nodes = np.where(fill[:, None], places, measured.nodes)
        return replace(measured, nodes=nodes.astype(measured.nodes.dtype), valid=seen | fill)
