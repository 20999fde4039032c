"""A path of the end's pose: straight moves and revolutions, run through one after the other.

Curve i takes the parameter s from i to i + 1; a time law says when. Every curve is smooth, every time law
is three times continuously differentiable and comes to rest between the curves, so the pose over time is
three times continuously differentiable too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics import rotation
from tcrctl.signals import Array
from tcrctl.trajectory.time_law import Phase, TimeLaw

MM = 1e-3  # [m]


@dataclass(frozen=True, slots=True)
class EndPose:
    """A pose of the end.

    Attributes:
        position: End position (3,) [m].
        normal: Unit end normal (3,), or None if the orientation is free.
    """

    position: Array
    normal: Array | None


class PoseCurve(Protocol):
    """Pose over a parameter x from 0 to 1."""

    def position(self, x: Array) -> Array:
        """Return positions (n, 3) [m] at x (n,)."""
        ...

    def normal(self, x: Array) -> Array | None:
        """Return unit normals (n, 3) at x (n,), or None if the orientation is free."""
        ...


@dataclass(frozen=True, slots=True)
class StraightMove:
    """Straight line, while the normal goes along the great circle: the shortest turn, without twist.

    Attributes:
        start: First pose.
        end: Last pose; both have a normal or neither.
    """

    start: EndPose
    end: EndPose

    def position(self, x: Array) -> Array:
        """Return positions (n, 3) [m] at x (n,)."""
        return self.start.position + x[:, None] * (self.end.position - self.start.position)

    def normal(self, x: Array) -> Array | None:
        """Return unit normals (n, 3) at x (n,), or None."""
        if self.start.normal is None or self.end.normal is None:
            return None
        normal: Array = rotation.slerp(self.start.normal, self.end.normal, x)
        return normal

    @property
    def length(self) -> float:
        """Length of the line [m]."""
        return float(np.linalg.norm(self.end.position - self.start.position))

    @property
    def angle(self) -> float:
        """Angle that the normal turns [rad]."""
        if self.start.normal is None or self.end.normal is None:
            return 0.0
        return float(rotation.angle_between(self.start.normal, self.end.normal))


@dataclass(frozen=True, slots=True)
class Revolution:
    """Turning about an axis; radius, height and tilt change in proportion to the angle turned.

    Attributes:
        centre: Point of the axis at height 0 (3,) [m].
        frame: Rows: the direction of angle 0, the one of angle pi/2, the axis (3, 3), orthonormal.
        angle: Angle at the start and at the end [rad].
        radius: Radius at the start and at the end [m].
        height: Along the axis, at the start and at the end [m].
        tilt: Angle from the axis to the normal, positive away from the axis, at the start and the end [rad].
    """

    centre: Array
    frame: Array
    angle: tuple[float, float]
    radius: tuple[float, float]
    height: tuple[float, float]
    tilt: tuple[float, float]

    def position(self, x: Array) -> Array:
        """Return positions (n, 3) [m] at x (n,)."""
        out, along = _between(self.radius, x), _between(self.height, x)
        position: Array = self.centre + out[:, None] * self._outward(x) + along[:, None] * self.frame[2]
        return position

    def normal(self, x: Array) -> Array:
        """Return unit normals (n, 3) at x (n,)."""
        tilt = _between(self.tilt, x)[:, None]
        normal: Array = np.sin(tilt) * self._outward(x) + np.cos(tilt) * self.frame[2]
        return normal

    def _outward(self, x: Array) -> Array:
        angle = _between(self.angle, x)[:, None]
        outward: Array = np.cos(angle) * self.frame[0] + np.sin(angle) * self.frame[1]
        return outward

    def pose(self, x: float) -> EndPose:
        """Return one pose."""
        at = np.array([x])
        return EndPose(self.position(at)[0], self.normal(at)[0])


def _between(ends: tuple[float, float], x: Array) -> Array:
    return ends[0] + (ends[1] - ends[0]) * x


@dataclass(frozen=True, slots=True)
class PoseMove:
    """A curve and when it is run through, or a rest.

    Attributes:
        curve: The curve; None for a rest.
        phases: Its parameter over time, from 0 to 1; constant for a rest.
    """

    curve: PoseCurve | None
    phases: list[Phase]


def rest(duration: float) -> PoseMove:
    """Return a rest of some duration [s], perhaps 0."""
    return PoseMove(None, [Phase(duration, 0.0, 0.0)] if duration > 0.0 else [])


def blend(curve: PoseCurve, duration: float) -> PoseMove:
    """Return a move from rest to rest in a given time [s], accelerating during its first half."""
    return turn(curve, duration, 0.5 * duration)


def turn(curve: PoseCurve, duration: float, ramp: float) -> PoseMove:
    """Return a move from rest to rest in a given time at constant speed but for the ramps.

    Args:
        curve: The curve.
        duration: All of it [s].
        ramp: Duration of starting and of stopping, at most half of it [s].
    """
    top = 1.0 / (duration - ramp)
    cruise = duration - 2.0 * ramp
    phases = [Phase(ramp, 0.0, top), Phase(cruise, top, top), Phase(ramp, top, 0.0)]
    return PoseMove(curve, [phase for phase in phases if phase.duration > 0.0])


@dataclass(frozen=True, slots=True)
class PosePath:
    """Moves and rests in time; before the start and after the end it stands still.

    Attributes:
        curves: What is run through, at least one.
        time_law: Curve parameter over time, curve i from i to i + 1.
    """

    curves: tuple[PoseCurve, ...]
    time_law: TimeLaw

    @classmethod
    def of(cls, moves: Sequence[PoseMove]) -> PosePath:
        """Line up moves, at least one with a curve."""
        return cls(
            tuple(move.curve for move in moves if move.curve is not None),
            TimeLaw.of([phase for move in moves for phase in move.phases]),
        )

    @property
    def duration(self) -> float:
        """Time until the end of the last rest [s]."""
        return self.time_law.total

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]; clamped beyond the ends."""
        position = np.empty((t.size, 3))
        for curve, x, chosen in self._located(t):
            position[chosen] = curve.position(x)
        return position

    def normal(self, t: Array) -> Array | None:
        """Return unit end normals at times t (n,) [s] as (n, 3), or None if the orientation is free."""
        normal = np.empty((t.size, 3))
        for curve, x, chosen in self._located(t):
            part = curve.normal(x)
            if part is None:
                return None
            normal[chosen] = part
        return normal

    def _located(self, t: Array) -> list[tuple[PoseCurve, Array, NDArray[np.intp]]]:
        """Return the curves, their parameters and the indices of the times that fall on them."""
        s = self.time_law.arc_length(t)
        index = np.clip(np.floor(s), 0, len(self.curves) - 1).astype(np.intp)
        found = []
        for i in np.unique(index):
            chosen = np.flatnonzero(index == i)
            found.append((self.curves[i], np.clip(s[chosen] - i, 0.0, 1.0), chosen))
        return found


def unit(vector: Sequence[float] | Array) -> Array:
    """Return a direction (3,) with length exactly 1."""
    direction = np.array(vector, dtype=float)
    scaled: Array = direction / np.linalg.norm(direction)
    return scaled


def radians(span: tuple[float, float]) -> tuple[float, float]:
    """Return both angles in rad."""
    return math.radians(span[0]), math.radians(span[1])
