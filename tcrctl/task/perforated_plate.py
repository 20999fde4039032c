"""Distance from points and segments to thin flat plates with round holes.

A plate is a rectangle without the holes. Its frame: origin in the middle, axes u and v along its sides, w across.
Holes lie inside the rectangle and apart from each other. Kernels: arrays in, numbers out, no checks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array

DEEPEST = 40  # halvings of a segment; it is below any tolerance then


@part()
def point_distance(u: float, v: float, w: float, half: Array, holes: Array) -> float:
    """Return the distance of a point to a plate.

    Args:
        u: First coordinate of the point in the plate's frame [m].
        v: Second one [m].
        w: Third one, across the plate [m].
        half: Half of the sides along u and v (2,) [m].
        holes: Centre u, centre v, radius (n, 3) [m].

    Returns:
        The distance [m].
    """
    beyond_u, beyond_v = max(abs(u) - half[0], 0.0), max(abs(v) - half[1], 0.0)
    for i in range(holes.shape[0]):
        from_centre = math.hypot(u - holes[i, 0], v - holes[i, 1])
        if from_centre < holes[i, 2]:  # the nearest point of the plate is on the rim of this hole
            return math.hypot(holes[i, 2] - from_centre, w)
    return math.sqrt(beyond_u * beyond_u + beyond_v * beyond_v + w * w)


@part()
def segment_distance(
    start: Array, end: Array, half: Array, holes: Array, farthest: float, tolerance: float
) -> float:
    """Return the distance of a segment to a plate, by branch and bound.

    The distance to the plate changes along the segment by no more than the length gone. A part with half length r
    whose middle has the distance D holds nothing nearer than D - r: it is halved as long as that could matter.

    Args:
        start: In the plate's frame (3,) [m].
        end: Likewise.
        half: Half of the sides along u and v (2,) [m].
        holes: Centre u, centre v, radius (n, 3) [m].
        farthest: Distances from this one on are of no interest [m].
        tolerance: By how much the result may be too large [m].

    Returns:
        The distance, or ``farthest`` if it is smaller [m].
    """
    du, dv, dw = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = math.sqrt(du * du + dv * dv + dw * dw)
    u, v, w = start[0] + 0.5 * du, start[1] + 0.5 * dv, start[2] + 0.5 * dw
    if point_distance(u, v, w, half, holes) - 0.5 * length >= farthest:
        return farthest
    parts, depths = np.empty(DEEPEST + 2), np.empty(DEEPEST + 2, np.int64)
    parts[0], depths[0], waiting, best = 0.5, 0, 1, farthest
    while waiting > 0:
        waiting -= 1
        at, depth = parts[waiting], depths[waiting]
        width = 0.5 ** (depth + 1)
        distance = point_distance(start[0] + at * du, start[1] + at * dv, start[2] + at * dw, half, holes)
        best = min(best, distance)
        if distance - width * length < best - tolerance and depth < DEEPEST:
            for side in (-0.5, 0.5):
                parts[waiting], depths[waiting] = at + side * width, depth + 1
                waiting += 1
    return best


@part()
def crosses(start: Array, end: Array, half: Array, holes: Array) -> bool:
    """Tell whether a segment goes through the material of a plate; arguments as in ``segment_distance``."""
    if start[2] * end[2] > 0.0 or start[2] == end[2]:
        return False
    at = start[2] / (start[2] - end[2])
    u, v = start[0] + at * (end[0] - start[0]), start[1] + at * (end[1] - start[1])
    return point_distance(u, v, 0.0, half, holes) == 0.0


class Plates(NamedTuple):
    """Several plates in one world frame.

    Attributes:
        middle: Their middles (n, 3) [m].
        frame: Rows: unit directions u, v, w of each (n, 3, 3).
        half: Half of the sides along u and v (n, 2) [m].
        first_hole: Holes of plate i are first_hole[i] .. first_hole[i + 1] - 1 (n + 1,).
        holes: Centre u, centre v, radius (n_holes, 3) [m].
    """

    middle: Array
    frame: Array
    half: Array
    first_hole: NDArray[np.int64]
    holes: Array


@part()
def _local(plates: Plates, i: int, point: Array, found: Array) -> None:
    """Put the coordinates of a point (3,) in the frame of plate i into ``found`` (3,)."""
    frame, middle = plates.frame, plates.middle
    x, y, z = point[0] - middle[i, 0], point[1] - middle[i, 1], point[2] - middle[i, 2]
    for a in range(3):
        found[a] = frame[i, a, 0] * x + frame[i, a, 1] * y + frame[i, a, 2] * z


@kernel()
def nearest(
    plates: Plates, start: Array, end: Array, farthest: float, tolerance: float
) -> tuple[float, int, int]:
    """Find the segment and the plate that are nearest to each other.

    Args:
        plates: The plates.
        start: Where the segments begin (n, 3) [m].
        end: Where they end (n, 3) [m].
        farthest: Distances from this one on are of no interest [m].
        tolerance: By how much the distance may be too large [m].

    Returns:
        The distance [m], the segment's row and the plate's; ``farthest``, -1, -1 if nothing is nearer.
    """
    best = farthest
    segment = -1
    plate = -1
    a, b = np.empty(3), np.empty(3)
    for i in range(plates.half.shape[0]):
        holes = plates.holes[plates.first_hole[i] : plates.first_hole[i + 1]]
        for j in range(start.shape[0]):
            _local(plates, i, start[j], a)
            _local(plates, i, end[j], b)
            distance = segment_distance(a, b, plates.half[i], holes, best, tolerance)
            if distance < best:
                best = distance
                segment = j
                plate = i
    return best, segment, plate


@kernel()
def blocks(plates: Plates, start: Array, end: Array) -> bool:
    """Tell whether the segment between two points (3,) [m] goes through the material of any plate."""
    a, b = np.empty(3), np.empty(3)
    for i in range(plates.half.shape[0]):
        _local(plates, i, start, a)
        _local(plates, i, end, b)
        if crosses(a, b, plates.half[i], plates.holes[plates.first_hole[i] : plates.first_hole[i + 1]]):
            return True
    return False
