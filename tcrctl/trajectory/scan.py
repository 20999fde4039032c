"""``kind: scan``: looking round through a hole, strategy 2 of [TCR, Sec. V.F]."""

from __future__ import annotations

import math

import numpy as np

from tcrctl.numerics import rotation
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.pose_path import (
    MM,
    EndPose,
    PosePath,
    Revolution,
    StraightMove,
    blend,
    rest,
    turn,
    unit,
)
from tcrctl.trajectory.pose_settings import ScanSettings
from tcrctl.trajectory.waypoints import place_of

UP = np.array([0.0, 0.0, 1.0])
STEEP = 1e-6  # sine of the angle to the vertical below which "straight up" says nothing


def build_scan(settings: ScanSettings, robot: Robot) -> PosePath:
    """Plan a scan.

    Args:
        settings: The hole and the four stages.
        robot: The path starts at its rest pose.
    """
    curve = sweep(settings, robot.rest_position)
    home = EndPose(robot.rest_position, robot.rest_normal)
    at_hole = EndPose(curve.centre, curve.frame[2])
    aside = curve.pose(0.0)
    before = EndPose(curve.centre + MM * settings.insert_mm * curve.frame[2], curve.frame[2])
    insertion = [blend(StraightMove(before, at_hole), settings.insert_s)] if settings.insert_s > 0.0 else []
    return PosePath.of(
        [
            rest(settings.lead_in_s),
            blend(StraightMove(home, before), settings.approach_s),
            *insertion,
            blend(StraightMove(at_hole, aside), settings.tilt_s),
            turn(curve, settings.turn_s, settings.ramp_s),
            blend(StraightMove(aside, at_hole), settings.return_s),
            rest(settings.settle_s),
        ]
    )


def sweep(settings: ScanSettings, rest_position: Array) -> Revolution:
    """Return the 3rd stage: the normal once about the hole's axis, the position fixed."""
    assert settings.hole.axis is not None
    normal = -unit(settings.hole.axis)
    start, tilt = math.radians(settings.start_deg), math.radians(settings.tilt_deg)
    sense = 1.0 if settings.turn == "counter_clockwise" else -1.0
    return Revolution(
        centre=place_of(settings.hole, rest_position),
        frame=frame_about(normal),
        angle=(start, start + sense * 2.0 * math.pi),
        radius=(0.0, 0.0),
        height=(0.0, 0.0),
        tilt=(tilt, tilt),
    )


def frame_about(axis: Array) -> Array:
    """Return an orthonormal frame, rows (3, 3): as far up as possible, the axis times that, the axis.

    About a vertical axis the first row is the world's x axis.
    """
    across = np.cross(axis, UP)
    steep = np.linalg.norm(across) < STEEP
    first = np.array([1.0, 0.0, 0.0]) if steep else np.asarray(rotation.towards(axis, UP))
    return np.stack((first, np.cross(axis, first), axis))
