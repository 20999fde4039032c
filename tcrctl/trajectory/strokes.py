"""``kind: strokes``: a drawing of lines and arcs, like the letters of [TCR, Sec. V.C]; position only."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.corner import rounded, split_at_corners
from tcrctl.trajectory.plane_curve import MM, PlanePiece, stroke_pieces
from tcrctl.trajectory.settings import JOIN_TOLERANCE_MM, StrokeSettings, StrokesSettings
from tcrctl.trajectory.space_path import Plane, SpacePath, SpacePiece, lifted, straight
from tcrctl.trajectory.speed_plan import MotionLimits, rest_to_rest, zones
from tcrctl.trajectory.time_law import Phase, TimeLaw


@dataclass(frozen=True, slots=True)
class StrokesTrajectory:
    """Rest, then approach, strokes and travel moves, each from rest to rest along its path.

    Position and velocity are continuous, the acceleration along the path too; across the path it jumps by
    speed^2 / radius where a line runs into an arc, as it must on such a path.

    Attributes:
        path: Everything that is travelled, as one path.
        time_law: Arc length on it over time.
    """

    path: SpacePath
    time_law: TimeLaw

    @property
    def duration(self) -> float:
        """Time until the end of the last rest [s]."""
        return self.time_law.total

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]; clamped beyond the ends."""
        return self.path.position(self.time_law.arc_length(t))

    def normal(self, t: Array) -> None:
        """Return None: the orientation is free."""
        return


@dataclass(frozen=True, slots=True)
class Move:
    """A run from rest to rest, or a rest.

    Attributes:
        pieces: What is travelled; empty for a rest.
        phases: When.
    """

    pieces: list[SpacePiece]
    phases: list[Phase]


def build_strokes(settings: StrokesSettings, robot: Robot) -> StrokesTrajectory:
    """Plan a drawing.

    Args:
        settings: The drawing and its limits.
        robot: The approach starts at its rest position.

    Returns:
        The trajectory; it ends at the end of the last stroke.
    """
    plan = list(moves(settings, robot.rest_position))
    return StrokesTrajectory(
        SpacePath.of([piece for move in plan for piece in move.pieces]),
        TimeLaw.of([phase for move in plan for phase in move.phases]),
    )


def moves(settings: StrokesSettings, rest_position: Array) -> Iterator[Move]:
    """Yield lead-in, approach, strokes, dwells, travel moves and the final rest in order."""
    plane = Plane.of(settings.plane, rest_position)
    draw = _limits(settings, settings.speed_limit_mm_s)
    travel = _limits(settings, settings.travel_speed_limit_mm_s)
    position = rest_position
    yield _rest(settings.lead_in_s)
    for stroke in settings.strokes:
        runs = stroke_runs(stroke, settings)
        start = plane.point(runs[0][0].start)
        if np.linalg.norm(start - position) > JOIN_TOLERANCE_MM * MM:
            yield _run([straight(position, start)], travel)
        for run in runs:
            yield _run([lifted(piece, plane) for piece in run], draw)
        yield _rest(settings.dwell_s)
        position = plane.point(runs[-1][-1].point(runs[-1][-1].length))
    yield _rest(settings.settle_s)


def stroke_runs(stroke: StrokeSettings, settings: StrokesSettings) -> list[list[PlanePiece]]:
    """Return the parts of a stroke that are drawn without stopping."""
    corner_angle = math.radians(settings.corner_angle_deg)
    pieces = stroke_pieces(stroke)
    if settings.corner == "round":
        pieces = rounded(pieces, corner_angle, settings.corner_radius_mm * MM)
    return split_at_corners(pieces, corner_angle)


def _limits(settings: StrokesSettings, speed_mm_s: float) -> MotionLimits:
    return MotionLimits(speed_mm_s * MM, settings.acceleration_limit_mm_s2 * MM, settings.ramp_s)


def _run(pieces: list[SpacePiece], limits: MotionLimits) -> Move:
    return Move(pieces, rest_to_rest(zones([(p.length, p.curvature) for p in pieces], limits), limits))


def _rest(duration: float) -> Move:
    return Move([], [Phase(duration, 0.0, 0.0)] if duration > 0.0 else [])
