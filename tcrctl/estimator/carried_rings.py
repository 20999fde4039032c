"""Rings that move with the ring below them: where markers are that a frame does not show.

From one frame to the next a ring moves as the ring below it does, as if the joint between them were rigid, and
with those of its own markers that are seen: one shifts it, two turn it as well, as little as can be. From the base
upward every ring is complete before the next one asks for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.copies import copy_vector
from tcrctl.numerics.kernel import kernel, part
from tcrctl.numerics.rotation import matrix_from_quaternion, norm, rotation_between
from tcrctl.robot.module import RING
from tcrctl.robot.ring_axes import axes_of, centre_of
from tcrctl.signals import Array


@kernel()
def carry(before: Array, now: Array, seen: NDArray[np.bool_], known: NDArray[np.bool_]) -> None:
    """Put markers that are not seen where the ring below and the seen markers of their own ring carry them.

    Args:
        before: All markers in the last frame (n_markers, 3) [m].
        now: Those of this frame; rows that are not seen are written.
        seen: Which markers this frame has (n_markers,).
        known: Which markers have ever been seen (n_markers,); rings that were never whole neither move nor carry.
    """
    turn, old, new = _unturned(), np.zeros(3), np.zeros(3)  # the base does not move
    for first in range(0, seen.size, RING):
        if not (known[first] and known[first + 1] and known[first + 2]):
            continue
        ring, found = before[first : first + RING], now[first : first + RING]
        there = seen[first : first + RING]
        carried = np.empty((RING, 3))
        for i in range(RING):
            _move(turn, old, new, ring[i], carried[i])
        _meet(carried, found, there)
        for i in range(RING):
            for j in range(3):
                found[i, j] = found[i, j] if there[i] else carried[i, j]
        turn, old, new = _turn(axes_of(ring), axes_of(found)), centre_of(ring), centre_of(found)


@part()
def _meet(carried: Array, found: Array, there: NDArray[np.bool_]) -> None:
    """Move a carried ring rigidly onto its seen markers."""
    count, old, new = 0, np.zeros(3), np.zeros(3)
    for i in range(RING):
        if there[i]:
            count, old, new = count + 1, old + carried[i], new + found[i]
    if count == 0:
        return
    old, new, turn = old / count, new / count, _unturned()
    if count == RING - 1:
        a, b = (0 if there[0] else 1), (2 if there[2] else 1)
        was, is_now = carried[b] - carried[a], found[b] - found[a]
        turn = matrix_from_quaternion(rotation_between(was / norm(was), is_now / norm(is_now)))
    point = np.empty(3)
    for i in range(RING):
        copy_vector(carried[i], point)
        _move(turn, old, new, point, carried[i])


@part()
def _move(turn: Array, old: Array, new: Array, point: Array, moved: Array) -> None:
    """Put a point that a turn about ``old`` and the shift of ``old`` to ``new`` move where it then is."""
    for i in range(3):  # element by element: an assignment of rows would compile its error message, too
        moved[i] = new[i]
        for j in range(3):
            moved[i] += turn[i, j] * (point[j] - old[j])


@part()
def _unturned() -> Array:
    """Return the rotation (3, 3) that leaves everything as it is."""
    turn = np.zeros((3, 3))
    for i in range(3):
        turn[i, i] = 1.0
    return turn


@part()
def _turn(old: Array, new: Array) -> Array:
    """Return the rotation (3, 3) from one triple of axes to another, one axis per row."""
    turn = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for axis in range(3):
                turn[i, j] += new[axis, i] * old[axis, j]
    return turn
