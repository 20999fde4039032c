"""Markers that cameras lose for a moment, filled in where they must be.

Every marker sits about a millimetre beside its node. A ring that loses one of three for a frame would seem to jump
by that, and the end normal with it; so a lost marker is put on its node, as far beside it as it was. A ring that
is lost whole would let go of all that a wrong model has stored in the module above, and jump by millimetres; for a
moment it is taken to move on as it did.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array, Measurement

#: Markers of one ring.
RING: Final = 3
#: A lost marker is filled in for so long [s]; then it counts as not seen.
LONGEST: Final = 0.5
#: The same for the markers of a ring that is lost whole: nothing but its speed says where it is.
LONGEST_RING: Final = 0.1
#: Time constant of the mean place of a marker beside its node [s].
FILTER: Final = 1.0


class LostMarkers:
    """Remembers where markers sit beside their nodes; a frame with all markers passes as it is."""

    def __init__(self, count: int, period: float) -> None:
        """Take the number of markers and the control period [s]."""
        self._period = period
        self._missing, self._known = np.zeros(count), np.zeros(count, dtype=np.bool_)
        self._beside = np.zeros((count, 3))

    def filled(self, measured: Measurement, expected: Array) -> Measurement:
        """Return the frame with markers filled in that were lost a moment ago.

        Args:
            measured: The frame.
            expected: Where the nodes of all markers will be by the model (n_markers, 3) [m].
        """
        self._missing = np.where(measured.valid, 0.0, self._missing + self._period)
        of_seen_ring = np.repeat(measured.valid.reshape(-1, RING).any(axis=1), RING)
        longest = np.where(of_seen_ring, LONGEST, LONGEST_RING)
        fill = (self._missing > 0.0) & (self._missing < longest) & self._known
        if not fill.any():
            return measured
        nodes = np.where(fill[:, None], expected + self._beside, measured.nodes)
        return replace(measured, nodes=nodes.astype(measured.nodes.dtype), valid=measured.valid | fill)

    def remember(self, seen: NDArray[np.bool_], markers: NDArray[np.float32], nodes: Array) -> None:
        """Filter how far the seen markers are beside their nodes.

        Args:
            seen: Which markers the frame really had (n_markers,).
            markers: Their places (n_markers, 3) [m].
            nodes: Places of their nodes by the estimate (n_markers, 3) [m].
        """
        blend = np.where(self._known, -np.expm1(-self._period / FILTER), 1.0)[:, None]
        moved = self._beside + blend * (markers - nodes - self._beside)
        self._beside = np.where(seen[:, None], moved, self._beside)
        self._known |= seen
