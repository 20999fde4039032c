"""What is drawn of each kind of task; see :mod:`tcrctl.log.drawing`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from tcrctl.log.drawing import Ball, Drawing, Outline, Passage, Sight, circle
from tcrctl.task.box import Box, box_from_markers
from tcrctl.task.pipe import Pipe, pipe_from_markers
from tcrctl.task.settings import BoxInspectionSettings, LaserPipeSettings
from tcrctl.trajectory.pose_path import MM

#: How far beyond its bore a pipe's wall is drawn, for no file says how thick it is [m].
_WALL: Final = 0.002


def box_drawing(settings: BoxInspectionSettings) -> Drawing:
    """Return the walls with their holes, the objects, and the view of the camera."""
    box, camera = box_from_markers(settings.box), settings.camera
    centres = box.place(np.array([item.position_mm for item in settings.objects]))
    balls = [
        Ball(item.name, centre, MM * item.diameter_mm / 2.0)
        for item, centre in zip(settings.objects, centres, strict=True)
    ]
    half_angle = math.radians(camera.field_of_view_deg / 2.0)
    sight = Sight(MM * camera.ahead_mm, half_angle, MM * camera.range_mm)
    return Drawing(tuple(_walls(box)), tuple(balls), (), sight)


def _walls(box: Box) -> Iterator[Outline]:
    walls = box.walls
    for i, (middle, (u, v, w), half) in enumerate(zip(walls.middle, walls.frame, walls.half, strict=True)):
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * half
        yield Outline("wall", "", middle + signs @ np.stack((u, v)))
        for at_u, at_v, radius in walls.holes[walls.first_hole[i] : walls.first_hole[i + 1]]:
            yield Outline("hole", "", circle(middle + at_u * u + at_v * v, w, radius))


def pipe_drawing(settings: LaserPipeSettings) -> Drawing:
    """Return the pipes with their screens, and the beam."""
    pipes = [pipe_from_markers(pipe) for pipe in settings.pipes]
    outlines = tuple(outline for pipe in pipes for outline in _pipe(pipe))
    passages = tuple(Passage(pipe.name, *pipe.bore, pipe.screen) for pipe in pipes)
    reach = max(pipe.bore.length + pipe.screen for pipe in pipes)
    return Drawing(outlines, (), passages, Sight(0.0, 0.0, reach))


def _pipe(pipe: Pipe) -> Iterator[Outline]:
    entry, axis, length, radius = pipe.bore
    wide = radius + _WALL
    yield Outline("pipe", pipe.name, circle(entry, axis, wide))
    yield Outline("pipe", "", circle(entry + length * axis, axis, wide))
    for one, other in zip(
        circle(entry, axis, wide, 6), circle(entry + length * axis, axis, wide, 6), strict=True
    ):
        yield Outline("pipe", "", np.stack((one, other)))
    if pipe.screen > 0.0:
        yield Outline("screen", "", circle(entry + (length + pipe.screen) * axis, axis, 3.0 * radius))
