"""``kind: waypoints``: from the rest pose through a list of poses, each leg from rest to rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from tcrctl.numerics import rotation
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.pose_path import MM, EndPose, PoseMove, PosePath, StraightMove, rest, unit
from tcrctl.trajectory.pose_settings import PlaceSettings, WaypointSettings, WaypointsSettings
from tcrctl.trajectory.speed_plan import MotionLimits, Zone, rest_to_rest

QUICK = 1e6  # limit of a leg that goes nowhere; it takes two ramps


def build_waypoints(settings: WaypointsSettings, robot: Robot) -> PosePath:
    """Plan the legs.

    Args:
        settings: The waypoints and the limits.
        robot: The path starts at its rest pose.
    """
    oriented = settings.points[0].oriented
    home = EndPose(robot.rest_position, robot.rest_normal if oriented else None)
    return PosePath.of(list(legs(settings, home)))


def legs(settings: WaypointsSettings, home: EndPose) -> Iterator[PoseMove]:
    """Yield lead-in, legs, dwells and the final rest in order."""
    points = settings.points * settings.cycles
    poses = [home, *(pose_of(point, home.position) for point in points)]
    yield rest(settings.lead_in_s)
    for (start, end), point in zip(pairwise(poses), points, strict=True):
        move = StraightMove(start, end)
        limits = limits_of(move, settings)
        yield PoseMove(move, rest_to_rest([Zone(1.0, 0.0, limits.speed)], limits))
        yield rest(settings.dwell_s if point.dwell_s is None else point.dwell_s)
    yield rest(settings.settle_s)


def limits_of(move: StraightMove, settings: WaypointsSettings) -> MotionLimits:
    """Return the limits of the curve parameter, which runs from 0 to 1: position and normal keep theirs."""
    length, angle = move.length / MM, math.degrees(move.angle)

    def lowest(linear: float, angular: float) -> float:
        limits = [limit / size for limit, size in ((linear, length), (angular, angle)) if size > 1e-9]
        return min(limits, default=QUICK)

    return MotionLimits(
        # a leg shorter than its two ramps never gets faster than 1 / ramp
        min(lowest(settings.speed_limit_mm_s, settings.angular_speed_limit_deg_s), 1.0 / settings.ramp_s),
        lowest(settings.acceleration_limit_mm_s2, settings.angular_acceleration_limit_deg_s2),
        settings.ramp_s,
    )


def pose_of(point: WaypointSettings, rest_position: Array) -> EndPose:
    """Return the pose of a waypoint."""
    normal = None
    if point.normal is not None:
        normal = unit(point.normal)
    elif point.theta_deg is not None:
        theta_x, theta_y = (math.radians(angle) for angle in point.theta_deg)
        normal = rotation.normal_from_angles(theta_x, theta_y)
    return EndPose(place_of(point, rest_position), normal)


def place_of(place: PlaceSettings, rest_position: Array) -> Array:
    """Return the position of a place (3,) [m]."""
    if place.position_mm is not None:
        return MM * np.array(place.position_mm)
    return rest_position + MM * np.array(place.offset_mm)
