"""What every task offers, which kinds there are, and the targets that a trajectory gets from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from tcrctl.log.event import Event
from tcrctl.signals import Array, StepRecord
from tcrctl.task.box import box_from_markers, hole_target
from tcrctl.task.box_inspection import BoxInspection
from tcrctl.task.laser_pipe import LaserPipe
from tcrctl.task.pipe import Seen, pipe_from_markers
from tcrctl.task.settings import BoxInspectionSettings, LaserPipeSettings, TaskSettings
from tcrctl.trajectory.pose_path import MM, EndPose

#: Second word of the seed of marker noise, so that it differs from the noise of the plant.
_STREAM = 7


class Task(Protocol):
    """Judges a run by more than its tracking error: from the plant's truth, or from the estimate on a rig."""

    def observe(self, step: StepRecord) -> Sequence[Event]:
        """Take a step; return what happened in it."""
        ...

    def result(self) -> dict[str, Any]:
        """The object ``task`` of ``run --json``, for the steps so far."""
        ...


def task_targets(settings: TaskSettings, seed: int) -> Mapping[str, EndPose]:
    """Compute the named poses that the trajectory may go to, from the markers as the cameras see them.

    Args:
        settings: The task.
        seed: Seed of the marker noise.
    """
    seen = _noisy(MM * 1e-3 * settings.marker_noise_um, seed)
    if isinstance(settings, LaserPipeSettings):
        return {pipe.name: pipe_from_markers(pipe, seen).target for pipe in settings.pipes}
    box = box_from_markers(settings.box, seen)
    return {hole.name: hole_target(settings.box, box, hole) for hole in settings.box.holes}


def build_task(settings: TaskSettings, seed: int, rod_diameter: float) -> Task:
    """Build a task; it judges by where things really are.

    Args:
        settings: The task.
        seed: Seed of the marker noise.
        rod_diameter: Diameter of the robot's rods and rings [m].
    """
    if isinstance(settings, BoxInspectionSettings):
        return BoxInspection(settings, box_from_markers(settings.box), rod_diameter)
    targets = task_targets(settings, seed)
    pipes = [pipe_from_markers(pipe) for pipe in settings.pipes]
    return LaserPipe(pipes, [targets[pipe.name] for pipe in pipes], MM * settings.beam_mm / 2.0)


def _noisy(deviation: float, seed: int) -> Seen:
    """Cameras with noise of some standard deviation [m]."""
    random = np.random.default_rng((seed, _STREAM))

    def seen(markers: Array) -> Array:
        noisy: Array = markers + random.normal(0.0, deviation, markers.shape)
        return noisy

    return seen
