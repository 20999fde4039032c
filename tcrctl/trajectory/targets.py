"""Named poses that something else than the trajectory's own section defines, for instance a task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from tcrctl.trajectory.pose_path import MM, EndPose
from tcrctl.trajectory.section import Placed
from tcrctl.trajectory.settings import TrajectorySettings
from tcrctl.trajectory.values import Vector

Targets: TypeAlias = Mapping[str, EndPose]


def with_targets(settings: TrajectorySettings, targets: Targets) -> TrajectorySettings:
    """Return the section with the poses of its targets filled in.

    Args:
        settings: The section; every target it names is known.
        targets: Their poses, with a normal.
    """
    return settings.with_targets({name: _placed(pose) for name, pose in targets.items()})


def _placed(pose: EndPose) -> Placed:
    return Placed(_vector(pose.position / MM), None if pose.normal is None else _vector(pose.normal))


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
