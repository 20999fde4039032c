"""Where a pipe is, from the markers on it, [TCR, Sec. V.F, Fig. 17(b)]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tcrctl.signals import Array
from tcrctl.task.bore import Bore
from tcrctl.task.settings import LaserPipeSettings, PipeSettings
from tcrctl.trajectory.pose_path import MM, EndPose

Seen = Callable[[Array], Array]
"""Marker positions (n, 3) [m] as somebody sees them."""


def exactly(markers: Array) -> Array:
    """See the markers (n, 3) [m] where they are."""
    return markers


@dataclass(frozen=True, slots=True)
class Pipe:
    """A pipe in the world.

    Attributes:
        name: Its name.
        bore: What the beam has to go through.
        target: The end stands before the entry on the axis and looks along it.
        screen: Distance of the screen from the exit, across the axis [m].
    """

    name: str
    bore: Bore
    target: EndPose
    screen: float


def pipe_from_markers(settings: PipeSettings, seen: Seen = exactly) -> Pipe:
    """Compute a pipe: entry and exit are the centres of the markers around them.

    Args:
        settings: The pipe and its markers.
        seen: How the markers are seen.
    """
    markers = (settings.entry_markers_mm, settings.exit_markers_mm)
    entry, end = (np.mean(seen(MM * np.array(ring)), axis=0) for ring in markers)
    length = float(np.linalg.norm(end - entry))
    axis = (end - entry) / length
    return Pipe(
        settings.name,
        Bore(entry, axis, length, MM * settings.bore_mm / 2.0),
        EndPose(entry - MM * settings.standoff_mm * axis, -axis),
        MM * settings.screen_mm,
    )


def pipe_targets(settings: LaserPipeSettings, seen: Seen) -> dict[str, EndPose]:
    """Return the pose before every pipe, by its name, from its markers as they are seen."""
    return {pipe.name: pipe_from_markers(pipe, seen).target for pipe in settings.pipes}
