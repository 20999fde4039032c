"""The task in the 3-D scene of viewers: walls, holes, objects, pipes, and what the end sees or sends out."""

from __future__ import annotations

from typing import Final

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.drawing import Drawing, Kind, Sight, cone
from tcrctl.log.scene_primitives import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LOOP,
    ORANGE,
    PAIRS,
    RED,
    Colour,
    add_line,
    add_sphere,
    add_text,
    locked,
)

_EDGE_THICKNESS_M: Final = 0.0012
_COLOURS: Final[dict[Kind, Colour]] = {"wall": GREY, "hole": ORANGE, "pipe": DARK, "screen": BLUE}
#: Lines from a camera to the rim of its view.
_RAYS: Final = 6


def add_task(update: SceneUpdate, drawing: Drawing, end: str, world: str, when: Timestamp) -> None:
    """Add what is drawn of a task.

    Args:
        update: The scene.
        drawing: The task.
        end: Coordinate frame of the end.
        world: Coordinate frame of the world.
        when: Time of the step.
    """
    if drawing.outlines:
        edges = update.entities.add(id="task", frame_id=world, timestamp=when)
        for outline in drawing.outlines:
            add_line(edges, LOOP, outline.points, _EDGE_THICKNESS_M, _COLOURS[outline.kind])
            if outline.label:
                add_text(edges, outline.label, outline.points.mean(axis=0), DARK)
    for ball in drawing.balls:
        entity = update.entities.add(id=f"object {ball.name}", frame_id=world, timestamp=when)
        add_sphere(entity, ball.centre, 2.0 * ball.radius, GREEN)
        add_text(entity, ball.name, ball.centre + np.array([0.0, 0.0, 2.0 * ball.radius]), DARK)
    if drawing.sight is not None:
        _add_sight(update, drawing.sight, end, when)


def _add_sight(update: SceneUpdate, sight: Sight, end: str, when: Timestamp) -> None:
    eye = np.array([0.0, 0.0, -sight.ahead])
    if not sight.half_angle:
        beam = locked(update, "beam", end, when)
        add_line(beam, PAIRS, np.stack((eye, eye - (0.0, 0.0, sight.reach))), _EDGE_THICKNESS_M, RED)
        return
    view, rim = locked(update, "camera", end, when), cone(sight)
    add_line(view, LOOP, rim, _EDGE_THICKNESS_M, BLUE)
    rays = [np.stack((eye, point)) for point in rim[:: len(rim) // _RAYS]]
    add_line(view, PAIRS, np.concatenate(rays), _EDGE_THICKNESS_M, BLUE)
