"""What happens at the corners of a stroke: stop there, or replace the corner by a tangent arc."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from itertools import pairwise

from tcrctl.trajectory.plane_curve import PlanePiece, turn_angle

TANGENT_TOLERANCE = math.radians(1e-3)  # joins of typed numbers are never exactly tangent
BISECTIONS = 60  # halves the search interval to below rounding


@dataclass(frozen=True, slots=True)
class Rounding:
    """An arc that replaces a corner.

    Attributes:
        arc: The arc, tangent to both neighbours.
        tail: Length taken from the end of the piece before [m].
        head: Length taken from the start of the piece after [m].
    """

    arc: PlanePiece
    tail: float
    head: float


def is_corner(before: PlanePiece, after: PlanePiece, corner_angle: float) -> bool:
    """Return whether the direction changes by more than the corner angle [rad]."""
    return abs(turn_angle(before, after)) > corner_angle + TANGENT_TOLERANCE


def rounding(before: PlanePiece, after: PlanePiece, radius: float) -> Rounding | None:
    """Find the arc of a given radius that is tangent to both neighbours of a corner.

    Its centre keeps the distance ``radius`` to both, on the side to which the path turns. Between two lines
    that meet with a turn of angle a the arc stays within radius * (1 / cos(a / 2) - 1) of the corner.

    Args:
        before: Piece that ends in the corner.
        after: Piece that starts there.
        radius: Radius of the arc [m].

    Returns:
        The arc and what it replaces, or None if it needs more than half of a neighbour (always so where
        the path turns back on itself).
    """
    side = math.copysign(1.0, turn_angle(before, after))

    def centre(tail: float) -> complex:
        s = before.length - tail
        return before.point(s) + 1j * side * radius * before.direction(s)

    def clearance(tail: float) -> float:
        return side * after.left_distance(centre(tail)) - radius

    low, high = 0.0, 0.5 * before.length
    if not clearance(low) < 0.0 <= clearance(high):
        return None
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if clearance(middle) < 0.0 else (low, middle)
    tail, head = high, after.nearest(centre(high))
    start = before.point(before.length - tail)
    tangent = before.direction(before.length - tail)
    sweep = side * cmath.phase(after.direction(head) / tangent)
    if not (0.0 <= head <= 0.5 * after.length and sweep > 0.0):
        return None
    return Rounding(PlanePiece(start, tangent, side / radius, radius * sweep), tail, head)


def rounded(pieces: list[PlanePiece], corner_angle: float, radius: float) -> list[PlanePiece]:
    """Replace every corner of a stroke into which the arc fits.

    Args:
        pieces: Joined pieces.
        corner_angle: Change of direction from which on a join is a corner [rad].
        radius: Radius of the arcs [m].

    Returns:
        The new joined pieces; corners without room are left as they are.
    """
    joins = [
        rounding(before, after, radius) if is_corner(before, after, corner_angle) else None
        for before, after in pairwise(pieces)
    ]
    result: list[PlanePiece] = []
    for piece, entry, leave in zip(pieces, [None, *joins], [*joins, None], strict=True):
        if entry is not None:
            result.append(entry.arc)
        rest = piece.trimmed(entry.head if entry else 0.0, leave.tail if leave else 0.0)
        if rest.length > 0.0:
            result.append(rest)
    return result


def split_at_corners(pieces: list[PlanePiece], corner_angle: float) -> list[list[PlanePiece]]:
    """Cut a stroke into runs that are smooth enough to be drawn without stopping.

    Args:
        pieces: Joined pieces, at least one.
        corner_angle: Change of direction from which on a join is a corner [rad].
    """
    runs = [[pieces[0]]]
    for before, after in pairwise(pieces):
        if is_corner(before, after, corner_angle):
            runs.append([after])
        else:
            runs[-1].append(after)
    return runs
