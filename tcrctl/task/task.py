"""What every task offers, which kinds there are, and the targets that a trajectory gets from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from tcrctl.config.settings import Settings
from tcrctl.log.drawing import Drawing
from tcrctl.log.event import Event
from tcrctl.signals import Array, StepRecord
from tcrctl.task.box import hole_targets
from tcrctl.task.box_inspection import build_box_inspection
from tcrctl.task.drawing import box_drawing, pipe_drawing
from tcrctl.task.laser_pipe import build_laser_pipe
from tcrctl.task.pipe import Seen, pipe_targets
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
        """Return the object ``task`` of ``run --json``, for the steps so far."""
        ...


class Kind(NamedTuple):
    """One kind of task.

    Attributes:
        settings: Its section.
        build: Makes the task from its section, its targets and the diameter of the robot's rods [m].
        targets: Finds the named poses from the section and how its markers are seen.
        drawing: What pictures show of it.
    """

    settings: type[Settings]
    build: Callable[[Any, Mapping[str, EndPose], float], Task]
    targets: Callable[[Any, Seen], Mapping[str, EndPose]]
    drawing: Callable[[Any], Drawing]


#: Every ``task.kind``.
KINDS: Final[Mapping[str, Kind]] = {
    "laser_pipe": Kind(LaserPipeSettings, build_laser_pipe, pipe_targets, pipe_drawing),
    "box_inspection": Kind(BoxInspectionSettings, build_box_inspection, hole_targets, box_drawing),
}


def task_targets(settings: TaskSettings, seed: int) -> Mapping[str, EndPose]:
    """Compute the named poses that the trajectory may go to, from the markers as the cameras see them.

    Args:
        settings: The task.
        seed: Seed of the marker noise.
    """
    kind = KINDS[settings.kind]
    return kind.targets(settings, _noisy(MM * 1e-3 * settings.marker_noise_um, seed))


def task_drawing(settings: TaskSettings | None) -> Drawing:
    """Return what pictures show of a task; of none, nothing."""
    return Drawing() if settings is None else KINDS[settings.kind].drawing(settings)


def build_task(settings: TaskSettings, seed: int, rod_diameter: float) -> Task:
    """Build a task; it judges by where things really are.

    Args:
        settings: The task.
        seed: Seed of the marker noise.
        rod_diameter: Diameter of the robot's rods and rings [m].
    """
    return KINDS[settings.kind].build(settings, task_targets(settings, seed), rod_diameter)


def _noisy(deviation: float, seed: int) -> Seen:
    """Return what cameras see with noise of some standard deviation [m]."""
    random = np.random.default_rng((seed, _STREAM))

    def seen(markers: Array) -> Array:
        noisy: Array = markers + random.normal(0.0, deviation, markers.shape)
        return noisy

    return seen
