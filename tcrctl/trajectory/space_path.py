"""A path in space made of lines and circular arcs, parametrised by arc length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tcrctl.signals import Array
from tcrctl.trajectory.plane_curve import PlanePiece
from tcrctl.trajectory.settings import PlaneSettings


@dataclass(frozen=True, slots=True)
class Plane:
    """A drawing plane in the world frame.

    Attributes:
        origin: Drawing origin (3,) [m].
        x_axis: Unit vector (3,).
        y_axis: Unit vector, perpendicular to it (3,).
    """

    origin: Array
    x_axis: Array
    y_axis: Array

    @classmethod
    def of(cls, settings: PlaneSettings, rest_position: Array) -> Plane:
        """Place the plane relative to the rest end position (3,) [m]."""
        x_axis = np.array(settings.x_axis) / np.linalg.norm(settings.x_axis)
        y_axis = np.array(settings.y_axis) - np.dot(settings.y_axis, x_axis) * x_axis
        origin = rest_position + 1e-3 * np.array(settings.offset_mm)
        return cls(origin, x_axis, y_axis / np.linalg.norm(y_axis))

    def vector(self, z: complex) -> Array:
        """Return a direction of the plane in space (3,)."""
        return z.real * self.x_axis + z.imag * self.y_axis

    def point(self, z: complex) -> Array:
        """Return a point of the plane in space (3,) [m]."""
        return self.origin + self.vector(z)


@dataclass(frozen=True, slots=True)
class SpacePiece:
    """A line or a circular arc in space.

    Attributes:
        start: First point (3,) [m].
        tangent: Unit direction there (3,).
        normal: Unit direction to the left of it in the plane of the arc (3,); unused on a line.
        curvature: Positive when turning towards ``normal`` [1/m].
        length: Arc length [m].
    """

    start: Array
    tangent: Array
    normal: Array
    curvature: float
    length: float


def lifted(piece: PlanePiece, plane: Plane) -> SpacePiece:
    """Return a piece of a drawing in space."""
    return SpacePiece(
        plane.point(piece.start),
        plane.vector(piece.tangent),
        plane.vector(1j * piece.tangent),
        piece.curvature,
        piece.length,
    )


def straight(start: Array, end: Array) -> SpacePiece:
    """Return the straight line between two distinct points (3,) [m]."""
    length = float(np.linalg.norm(end - start))
    return SpacePiece(start, (end - start) / length, np.zeros(3), 0.0, length)


@dataclass(frozen=True, slots=True)
class SpacePath:
    """Joined pieces as one table.

    Attributes:
        s0: Arc length at the start of every piece (n,) [m].
        start: First points (n, 3) [m].
        tangent: Directions there (n, 3).
        normal: Directions to the left (n, 3).
        curvature: Signed curvatures (n,) [1/m].
    """

    s0: Array
    start: Array
    tangent: Array
    normal: Array
    curvature: Array

    @classmethod
    def of(cls, pieces: Sequence[SpacePiece]) -> SpacePath:
        """Line up pieces, at least one, from arc length 0."""
        lengths = np.array([piece.length for piece in pieces])
        return cls(
            np.concatenate(([0.0], np.cumsum(lengths)[:-1])),
            np.array([piece.start for piece in pieces]),
            np.array([piece.tangent for piece in pieces]),
            np.array([piece.normal for piece in pieces]),
            np.array([piece.curvature for piece in pieces]),
        )

    def position(self, s: Array) -> Array:
        """Return the points at arc lengths s (n,) [m] as (n, 3) [m].

        In the frame of tangent and normal an arc runs through (sin(c s), 1 - cos(c s)) / c, written with
        sinc so that lines need no case of their own.
        """
        i = np.clip(np.searchsorted(self.s0, s, side="right") - 1, 0, self.s0.size - 1)
        s = s - self.s0[i]
        turn = self.curvature[i] * s
        along = s * np.sinc(turn / np.pi)
        across = s * np.sin(0.5 * turn) * np.sinc(0.5 * turn / np.pi)
        return self.start[i] + along[:, None] * self.tangent[i] + across[:, None] * self.normal[i]
