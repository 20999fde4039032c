"""The robot before it moves: where it is, and whether what the cameras show of it can be believed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from tcrctl.errors import ArmingRefusedError
from tcrctl.estimator.calibration import MarkerCalibration
from tcrctl.picture.judge import PictureJudge
from tcrctl.picture.objections import objections
from tcrctl.picture.picture import Picture, Unjudged
from tcrctl.picture.settings import PictureSettings
from tcrctl.plant.plant import Plant
from tcrctl.robot import pose
from tcrctl.robot.module import ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Measurement

#: Measurements that are averaged to find where the robot is before it moves.
START_READS: Final = 10
#: What to do if the picture is not believed.
HINT: Final = "Labels and calibration: tcrctl rig check, tcrctl rig calibrate. Limits: safety.picture."

Report = Callable[[str, str, str], None]


def first_frames(plant: Plant) -> list[Measurement]:
    """Return measurements of a plant at rest.

    Raises:
        DeviceError: If it cannot be measured.
    """
    return [plant.read() for _ in range(START_READS)]


def measured_pose(
    frames: Sequence[Measurement], robot: Robot, calibration: MarkerCalibration
) -> tuple[Array, Array] | None:
    """End position (3,) [m] and normal (3,) as the cameras see them, averaged; None if they do not see them.

    Args:
        frames: Measurements of the robot at rest.
        robot: Says which nodes are the tip ring, and roughly how its rings lie.
        calibration: What is known of cameras and markers.
    """
    rows = ring_rows(robot.n_modules)
    tip, shape = rows.index(robot.tip), robot.rest.q.reshape(-1, 3)[rows]
    seen = [calibration.corrected(frame, shape) for frame in frames]
    rings = [m.nodes[tip : tip + 3].astype(float) for m in seen if m.valid[tip : tip + 3].all()]
    if not rings:
        return None
    ring = np.mean(rings, axis=0).ravel()
    return pose.position(ring, 0), pose.normal(ring, 0)


def build_picture(
    settings: PictureSettings, robot: Robot, period: float, frames: Sequence[Measurement], report: Report
) -> Picture:
    """Return who judges the pictures of one run; see :class:`PictureJudge`."""
    return PictureJudge(settings, robot, period, frames, report) if settings.judged else Unjudged()


def check_picture(settings: PictureSettings, robot: Robot, frames: Sequence[Measurement]) -> None:
    """Hold what the cameras show of a robot at rest against the model, before drives are armed.

    Raises:
        ArmingRefusedError: If it cannot be believed.
    """
    if not settings.judged:
        return
    if found := objections(settings, robot, frames):
        raise ArmingRefusedError([f"the cameras' picture is not believed: {found[0]}", *found[1:]], hint=HINT)
