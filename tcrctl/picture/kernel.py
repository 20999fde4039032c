"""The shape that markers show, ring by ring; see :mod:`tcrctl.picture.shape`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.kernel import kernel, part
from tcrctl.numerics.rotation import norm
from tcrctl.robot.module import RING
from tcrctl.robot.ring_axes import axes_of, centre_of
from tcrctl.signals import Array


class Shape(NamedTuple):
    """See :mod:`tcrctl.picture.shape`; n free rings, the joint above each.

    Attributes:
        side: From every marker of a ring to the next one of it (n, 3) [m].
        offset: (n, 3) [m].
        twist: (n,) [rad].
        bend: (n, 2), sines of angles.
    """

    side: Array
    offset: Array
    twist: Array
    bend: Array

    def since(self, start: Shape) -> Shape:
        """Return the change since another shape; twists by the shorter way."""
        change: Shape = change_since(start, self)
        return change


@kernel(error_model="numpy")
def change_since(start: Shape, now: Shape) -> Shape:
    """Return the change from one shape to another; twists by the shorter way."""
    n = now.twist.shape[0]
    change = Shape(np.empty((n, 3)), np.empty((n, 3)), np.empty(n), np.empty((n, 2)))
    for i in range(n):
        change.twist[i] = np.mod(now.twist[i] - start.twist[i] + np.pi, 2.0 * np.pi) - np.pi
        for k in range(3):
            change.side[i, k] = now.side[i, k] - start.side[i, k]
            change.offset[i, k] = now.offset[i, k] - start.offset[i, k]
        for k in range(2):
            change.bend[i, k] = now.bend[i, k] - start.bend[i, k]
    return change


@part(error_model="numpy")
def _along(a: Array, b: Array) -> float:
    """Return the product of two vectors (3,)."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel(error_model="numpy")
def measure(
    base: Array, apex: Array, markers: Array, seen: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Return sides (n, 3), offsets (n, 3) [m], twists (n,) [rad] and bends (n, 2); NaN for what is not seen.

    Args:
        base: Ring nodes of the base (3, 3) [m].
        apex: Apex of every module but the last in the axes of its ring, base first (n, 3) [m].
        markers: Ring nodes (3 n, 3) [m].
        seen: Which of them count (3 n,).
    """
    n = apex.shape[0]
    side, offset = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    twist, bend = np.full(n, np.nan), np.full((n, 2), np.nan)
    above, above_at = axes_of(base), centre_of(base)
    above_seen = True
    for i in range(n):
        ring, there = markers[RING * i : RING * i + RING], seen[RING * i : RING * i + RING]
        for k in range(RING):
            if there[k] and there[(k + 1) % RING]:
                side[i, k] = norm(ring[k] - ring[(k + 1) % RING])
        whole = there[0] and there[1] and there[2]
        own, at = (axes_of(ring), centre_of(ring)) if whole else (above, above_at)
        if whole and above_seen:
            offset[i] = 0.0
            for k in range(3):
                for j in range(3):
                    arm = above_at[j] - at[j]
                    for axis in range(3):
                        arm += above[axis, j] * apex[i, axis]
                    offset[i, k] += own[k, j] * arm
            twist[i] = np.arctan2(_along(own[1], above[0]), _along(own[0], above[0]))
            bend[i, 0], bend[i, 1] = _along(own[0], above[2]), _along(own[1], above[2])
        above, above_at, above_seen = own, at, whole
    return side, offset, twist, bend


@kernel(error_model="numpy")
def typical_change(now: Array, before: Array) -> float:
    """Return the median of how much values (n, 3) have changed, of those that are known; NaN if none is."""
    changes, count = np.empty(now.size), 0
    for i in range(now.shape[0]):
        for j in range(now.shape[1]):
            change = abs(now[i, j] - before[i, j])
            if change == change:
                _insert(changes, count, change)
                count += 1
    return 0.5 * (changes[(count - 1) // 2] + changes[count // 2]) if count else np.nan


@part(error_model="numpy")
def _insert(ordered: Array, count: int, value: float) -> None:
    """Put a value where it belongs among the first ``count`` of an array; numpy's median compiles for a second."""
    place = count
    while place > 0 and ordered[place - 1] > value:
        ordered[place] = ordered[place - 1]
        place -= 1
    ordered[place] = value
