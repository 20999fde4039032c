"""Named poses that something else than the trajectory's own section defines, for instance a task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from tcrctl.trajectory.pose_path import MM, EndPose
from tcrctl.trajectory.pose_settings import ScanSettings, WaypointSettings, WaypointsSettings
from tcrctl.trajectory.settings import TrajectorySettings
from tcrctl.trajectory.values import Vector

Targets: TypeAlias = Mapping[str, EndPose]


def with_targets(settings: TrajectorySettings, targets: Targets) -> TrajectorySettings:
    """Return the section with the poses of its targets filled in.

    Args:
        settings: The section; every target it names is known.
        targets: Their poses, with a normal.
    """
    if isinstance(settings, ScanSettings) and settings.hole.target is not None:
        pose = targets[settings.hole.target]
        assert pose.normal is not None
        hole = {"target": None, "position_mm": _mm(pose), "axis": _vector(-pose.normal)}
        return settings.model_copy(update={"hole": settings.hole.model_copy(update=hole)})
    if isinstance(settings, WaypointsSettings):
        points = tuple(_placed(point, targets) for point in settings.points)
        return settings.model_copy(update={"points": points})
    return settings


def _placed(point: WaypointSettings, targets: Targets) -> WaypointSettings:
    if point.target is None:
        return point
    pose = targets[point.target]
    normal = _vector(pose.normal) if point.face_target else None
    return point.model_copy(update={"target": None, "position_mm": _mm(pose), "normal": normal})


def _mm(pose: EndPose) -> Vector:
    return _vector(pose.position / MM)


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
