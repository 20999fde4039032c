"""Lines and arcs of a drawing, as pieces of constant curvature in the complex plane.

A point (x, y) is the complex number x + iy, so that turning left is a multiplication by i. With arc length s
and curvature c the piece runs along start + tangent * (exp(i c s) - 1) / (i c); c = 0 is the straight line.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from itertools import pairwise

from tcrctl.trajectory.settings import ArcSettings, StrokeSettings

MM = 1e-3  # [m]


@dataclass(frozen=True, slots=True)
class PlanePiece:
    """A line or a circular arc, drawn once.

    Attributes:
        start: First point [m].
        tangent: Unit direction at the start.
        curvature: Positive when turning left, 0 for a line [1/m].
        length: Arc length [m].
    """

    start: complex
    tangent: complex
    curvature: float
    length: float

    def point(self, s: float) -> complex:
        """Return the point at arc length s [m]."""
        half = 0.5 * self.curvature * s
        chord = s if half == 0.0 else s * math.sin(half) / half
        return self.start + self.tangent * chord * cmath.exp(1j * half)

    def direction(self, s: float) -> complex:
        """Return the unit tangent at arc length s [m]."""
        return self.tangent * cmath.exp(1j * self.curvature * s)

    def left_distance(self, point: complex) -> float:
        """Return the distance of a point from the whole line or circle, positive on the left [m]."""
        if self.curvature == 0.0:
            return ((point - self.start) * self.tangent.conjugate()).imag
        radius = 1.0 / self.curvature
        return radius - math.copysign(abs(point - self._centre()), radius)

    def nearest(self, point: complex) -> float:
        """Return the arc length of the foot point on the whole line, or within half a turn of the arc [m]."""
        if self.curvature == 0.0:
            return ((point - self.start) * self.tangent.conjugate()).real
        spoke = self.start - self._centre()
        return cmath.phase((point - self._centre()) / spoke) / self.curvature

    def trimmed(self, head: float, tail: float) -> PlanePiece:
        """Return the piece without its first ``head`` and its last ``tail`` metres."""
        return replace(
            self, start=self.point(head), tangent=self.direction(head), length=self.length - head - tail
        )

    def _centre(self) -> complex:
        return self.start + 1j * self.tangent / self.curvature


def turn_angle(before: PlanePiece, after: PlanePiece) -> float:
    """Return the change of direction at the join of two pieces, positive to the left, within ±pi [rad]."""
    return cmath.phase(after.tangent / before.direction(before.length))


def line_pieces(points: tuple[tuple[float, float], ...]) -> list[PlanePiece]:
    """Return the edges of a polyline.

    Args:
        points: Corner points, at least two, neighbours distinct [mm].
    """
    corners = [complex(x, y) * MM for x, y in points]
    pieces = []
    for start, end in pairwise(corners):
        length = abs(end - start)
        pieces.append(PlanePiece(start, (end - start) / length, 0.0, length))
    return pieces


def arc_piece(arc: ArcSettings) -> PlanePiece:
    """Return a circular arc."""
    start, sweep = math.radians(arc.from_deg), math.radians(arc.to_deg - arc.from_deg)
    spoke = cmath.exp(1j * start)
    left = math.copysign(1.0, sweep)
    radius = arc.radius * MM
    centre = complex(*arc.center) * MM
    return PlanePiece(centre + radius * spoke, 1j * left * spoke, left / radius, radius * abs(sweep))


def stroke_pieces(stroke: StrokeSettings) -> list[PlanePiece]:
    """Return all edges and arcs of a stroke in drawing order."""
    pieces: list[PlanePiece] = []
    for segment in stroke.segments:
        if segment.arc is not None:
            pieces.append(arc_piece(segment.arc))
        elif segment.line is not None:
            pieces.extend(line_pieces(segment.line))
    return pieces
