"""Where emulated cameras see markers that are somewhere else: wrong frames, wrong labels, markers that come loose.

markers -> drift -> turned, mirrored frame -> labels that move on or are exchanged
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import TrackedMarkers

Array = NDArray[np.float64]


class Distortion:
    """Distorts one frame after the other; remembers since when something drifts and turns."""

    def __init__(self) -> None:
        self._since: dict[str, float] = {}

    def seen(self, tracked: TrackedMarkers, positions: Array, faults: MotiveFaults, now: float) -> Array:
        """Return where the markers are seen (n, 3) [m].

        Args:
            tracked: Names and bodies.
            positions: Where they are (n, 3) [m].
            faults: What is wrong.
            now: Time of a clock that never jumps [s].
        """
        at = np.array(positions, float)
        drifting = self._elapsed("drift", bool(faults.drifting), now)
        if drifting:
            at[_rows(tracked, faults.drifting)] += 1e-3 * drifting * np.array(faults.drift_mm_s)
        at = self._in_frame(tracked, at, faults, now)
        for body in faults.moved_labels:
            rows = tracked.rows_of(body)
            at[rows] = at[np.roll(rows, 1)]
        for first, second in faults.exchanged:
            a, b = tracked.rows_of(first), tracked.rows_of(second)
            at[np.concatenate([a, b])] = at[np.concatenate([b, a])]
        return at

    def _in_frame(self, tracked: TrackedMarkers, at: Array, faults: MotiveFaults, now: float) -> Array:
        """Return markers in a frame that is turned and mirrored about the pivot."""
        pivot = at[tracked.rows_of(faults.pivot)].mean(axis=0) if faults.pivot else np.zeros(3)
        turning = self._elapsed("turn", any(faults.turning_deg_s), now)
        if any(faults.mirrored):
            across = np.array(faults.mirrored) / np.linalg.norm(faults.mirrored)
            at = at - 2.0 * ((at - pivot) @ across)[:, None] * across
        if turning or any(faults.turned_deg):
            angles = np.radians(faults.turned_deg) + turning * np.radians(faults.turning_deg_s)
            at = pivot + (at - pivot) @ Rotation.from_rotvec(angles).as_matrix().T
        return at

    def _elapsed(self, what: str, active: bool, now: float) -> float:
        """Return for how long something has been going on [s]; 0 if it is not."""
        if not active:
            self._since.pop(what, None)
            return 0.0
        return now - self._since.setdefault(what, now)


def _rows(tracked: TrackedMarkers, names: Iterable[str]) -> NDArray[np.intp]:
    return np.concatenate([tracked.rows_of(name) for name in names])
