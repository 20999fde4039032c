"""``kind: revolution``: turning about a vertical axis, as Exp_1 to Exp_3 of [TCR, Sec. V.D]."""

from __future__ import annotations

import math

import numpy as np

from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.pose_path import (
    MM,
    EndPose,
    PosePath,
    Revolution,
    StraightMove,
    blend,
    radians,
    rest,
    turn,
)
from tcrctl.trajectory.pose_settings import RevolutionSettings


def build_revolution(settings: RevolutionSettings, robot: Robot) -> PosePath:
    """Plan a revolution.

    Args:
        settings: The revolution.
        robot: The path starts at its rest pose.
    """
    curve = revolution(settings, robot.rest_position)
    home = EndPose(robot.rest_position, robot.rest_normal)
    first, last = curve.pose(0.0), curve.pose(1.0)
    turning = abs(settings.turns) * settings.turn_s + settings.ramp_s
    moves = [
        rest(settings.lead_in_s),
        blend(StraightMove(home, first), settings.blend_in_s),
        rest(settings.dwell_s),
        turn(curve, turning, settings.ramp_s),
        rest(settings.dwell_s),
    ]
    if settings.blend_out_s > 0.0:
        moves.append(blend(StraightMove(last, home), settings.blend_out_s))
    return PosePath.of([*moves, rest(settings.settle_s)])


def revolution(settings: RevolutionSettings, rest_position: Array) -> Revolution:
    """Return the curve about the vertical axis."""
    start = math.radians(settings.start_deg)
    side = 1.0 if settings.lean == "outward" else -1.0
    tilt = radians(settings.tilt_deg)
    return Revolution(
        centre=rest_position + MM * np.array(settings.offset_mm),
        frame=np.eye(3),
        angle=(start, start + 2.0 * math.pi * settings.turns),
        radius=(MM * settings.radius_mm[0], MM * settings.radius_mm[1]),
        height=(MM * settings.height_mm[0], MM * settings.height_mm[1]),
        tilt=(side * tilt[0], side * tilt[1]),
    )
