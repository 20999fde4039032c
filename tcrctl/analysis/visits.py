"""Where the end was wanted to stand, what it attained there, and how it went from one such pose to the next."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np

from tcrctl.analysis.history import History
from tcrctl.signals import Array

#: A reference that stands for so long is a pose that is to be attained [s].
STAY_S: Final = 0.8
#: What is attained is the mean over the last part of the stay [s].
WINDOW_S: Final = 0.5
#: Poses as near as this are the same [m], and in their normals.
SAME: Final = 1e-6
#: A turn of the normal by one radian counts on a path as this way [m]: a ring's radius.
LEVER: Final = 0.035
#: Points at which passes along a path are compared.
POINTS: Final = 50

Span: TypeAlias = tuple[int, int]
"""First step, and the one behind the last."""


@dataclass(frozen=True, slots=True)
class Visit:
    """One time that a pose was attained.

    Attributes:
        pose: Number of the pose.
        origin: Number of the pose that it was approached from.
        wanted: Position [m] and normal (6,); the normal is NaN where it is free.
        attained: The same, mean over the end of the stay (6,).
    """

    pose: int
    origin: int
    wanted: Array
    attained: Array


@dataclass(frozen=True, slots=True)
class Pass:
    """One time that a path from pose to pose was gone along.

    Attributes:
        path: Numbers of both poses.
        wanted: Positions at evenly spaced points of the path (POINTS, 3) [m].
        attained: Where the end was when these were wanted (POINTS, 3) [m].
    """

    path: tuple[int, int]
    wanted: Array
    attained: Array


class Poses:
    """The poses of some runs, numbered as they come."""

    def __init__(self) -> None:
        self._known: list[Array] = []

    def number(self, pose: Array) -> int:
        """Return the number of a pose (6,), a new one if it is not known."""
        for i, known in enumerate(self._known):
            if np.nanmax(np.abs(known - pose)) < SAME:
                return i
        self._known.append(pose)
        return len(self._known) - 1


def visits_of(histories: Sequence[History]) -> tuple[list[Visit], list[Pass]]:
    """Return every visit of a pose and every pass from one to the next, in the order of time.

    The stay that a run begins with is no visit: nothing approached it.

    Args:
        histories: Runs; all count as repetitions.
    """
    poses, visits, passes = Poses(), list[Visit](), list[Pass]()
    for history in histories:
        wanted = np.hstack([history.wanted_position, history.wanted_normal])
        attained = np.hstack([history.position, history.normal])
        window = max(1, round(WINDOW_S / float(np.median(history.period))))
        for (_, left), (begin, end) in pairwise(_from_start(_stays(wanted, history.t))):
            origin, pose = poses.number(wanted[left - 1]), poses.number(wanted[begin])
            mean = np.mean(attained[max(begin, end - window) : end], axis=0)
            visits.append(Visit(pose, origin, wanted[begin], mean))
            way = slice(left - 1, begin + 1)
            passes.append(Pass((origin, pose), *_sampled(wanted[way], attained[way, :3])))
    return visits, passes


def _stays(wanted: Array, t: Array) -> Iterator[Span]:
    """Yield where the reference (n, 6) stands still."""
    moves = np.nanmax(np.abs(np.diff(wanted, axis=0)), axis=1, initial=0.0) > 0.0
    edges = np.concatenate([[0], np.flatnonzero(moves) + 1, [len(t)]])
    for begin, end in pairwise(edges.tolist()):
        if t[end - 1] - t[begin] >= STAY_S:
            yield begin, end


def _from_start(stays: Iterable[Span]) -> list[Span]:
    """Return stays with the pose that a run begins at before them, if it does not rest there."""
    found = list(stays)
    return found if not found or found[0][0] == 0 else [(0, 1), *found]


def _sampled(wanted: Array, attained: Array) -> tuple[Array, Array]:
    """Return both (POINTS, 3) at evenly spaced points of the way that was wanted (n, 6)."""
    turned = np.nan_to_num(np.diff(wanted[:, 3:], axis=0)) * LEVER
    steps = np.linalg.norm(np.hstack([np.diff(wanted[:, :3], axis=0), turned]), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, way[-1], POINTS)
    both = (np.column_stack([np.interp(at, way, x) for x in rows.T]) for rows in (wanted[:, :3], attained))
    first, second = both
    return first, second
