"""Rests in a log: drives that stand still, markers averaged, and from which side every cable came."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import InputError
from tcrctl.identify.calibration.settings import RestSettings
from tcrctl.log.reader import Log
from tcrctl.signals import Array

#: Set-points that move by less than this in a step stand still [m].
STILL: Final = 2e-5
#: Fewest frames of a rest that are averaged.
FEWEST: Final = 4
#: Way of a drive from edge to edge of its play, when that is not known yet [m].
PLAY: Final = 2e-4
#: Frames in which a marker is so many times as far away as usual do not count ...
FAR: Final = 5.0
#: ... with at least this as the usual distance [m].
NEAR: Final = 5e-5
#: A cable nearer to an edge of its friction than this was not shaken.
EDGE: Final = 0.6
COLUMNS: Final = ("t", "measurement_nodes", "measurement_valid", "measurement_drive", "applied_drive")


@dataclass(frozen=True, slots=True)
class Rests:
    """All rests of a log, in order.

    Attributes:
        t: Their ends (k,) [s].
        drive: What the drives report (k, m) [m].
        markers: Mean places of the markers (k, n_markers, 3) [m]; NaN where one was not seen.
        slid: Where every cable is between the edges of its friction, +1 after a pull (k, m).
        pushed: The same of the play of its drive (k, m).
    """

    t: Array
    drive: Array
    markers: Array
    slid: Array
    pushed: Array

    @property
    def shaken(self) -> NDArray[np.intp]:
        """Which of them came after a shake, or before any motion: friction holds back little there."""
        return np.flatnonzero(np.abs(self.slid).max(axis=1) < EDGE)

    def only(self, which: NDArray[np.intp]) -> Rests:
        """Return some of them."""
        return Rests(
            self.t[which], self.drive[which], self.markers[which], self.slid[which], self.pushed[which]
        )


def read_rests(log: Log, settings: RestSettings) -> Rests:
    """Find the rests of a log.

    Raises:
        InputError: If there are none.
        LogError: If the log is damaged.
    """
    columns = log.columns(COLUMNS)
    t, applied = columns["t"], columns["applied_drive"]
    slid = stop(columns["measurement_drive"], 1e-3 * settings.presliding_mm)
    pushed = stop(columns["measurement_drive"], PLAY)
    found = []
    for last in _ends(t, applied, settings.least_s):
        within = np.flatnonzero((t > t[last] - settings.window_s) & (t <= t[last]))
        markers = columns["measurement_nodes"][within].astype(float)
        markers[~columns["measurement_valid"][within]] = np.nan
        drive = columns["measurement_drive"][within].mean(axis=0)
        found.append((t[last], drive, _mean(markers), slid[last], pushed[last]))
    if not found:
        raise InputError(
            f"{log.path}: the drives never stand still for {settings.least_s:g} s",
            hint="Calibrate from the log of an excitation: tcrctl run excitation",
        )
    return Rests(*(np.array(part) for part in zip(*found, strict=True)))


def stop(drive: Array, width: float) -> Array:
    """Return where a point with friction is between its edges, -1 to 1, while its drive moves.

    Args:
        drive: Drive lengths over time (k, m) [m].
        width: Way from edge to edge [m].
    """
    place, places = np.zeros(drive.shape[1]), np.zeros(drive.shape)
    for k in range(1, drive.shape[0]):
        place = np.clip(place + (drive[k] - drive[k - 1]) / (0.5 * width), -1.0, 1.0)
        places[k] = place
    return places


def _ends(t: Array, applied: Array, least: float) -> list[int]:
    """Last steps of all rests."""
    if len(t) < 2:  # a run that was stopped before it moved
        return []
    moves = np.abs(np.diff(applied, axis=0)).max(axis=1) > STILL
    edges = (np.flatnonzero(moves) + 1).tolist()
    firsts, lasts = [0, *edges], [*(k - 1 for k in edges), len(t) - 1]
    return [b for a, b in zip(firsts, lasts, strict=True) if t[b] - t[a] >= least]


def _mean(frames: Array) -> Array:
    """Mean place of every marker (n_markers, 3) over frames (f, n_markers, 3), without outliers."""
    means = np.full(frames.shape[1:], np.nan)
    for i, places in enumerate(frames.transpose(1, 0, 2)):
        seen = places[np.isfinite(places[:, 0])]
        if len(seen) < FEWEST:
            continue
        away = np.abs(seen - np.median(seen, axis=0)).max(axis=1)
        means[i] = seen[away <= FAR * max(float(np.median(away)), NEAR)].mean(axis=0)
    return means
