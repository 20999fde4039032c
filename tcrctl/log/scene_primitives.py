"""Shapes of foxglove.SceneUpdate: lines, spheres, arrows, texts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.signals import Array

Colour = tuple[float, float, float]

STRIP: Final = LinePrimitive.LINE_STRIP
LOOP: Final = LinePrimitive.LINE_LOOP
PAIRS: Final = LinePrimitive.LINE_LIST
GREY: Final = (0.6, 0.6, 0.6)
DARK: Final = (0.25, 0.25, 0.25)
GREEN: Final = (0.0, 0.62, 0.45)
ORANGE: Final = (0.95, 0.55, 0.1)
BLUE: Final = (0.34, 0.71, 0.91)
RED: Final = (0.84, 0.2, 0.1)
_AXIS_LENGTH_M: Final = 0.09
_GRID: Final = 2.0**13  # coordinates are multiples of 0.12 mm: less than a pixel, and half the bytes
#: Turns x to -z: arrows point along x, the end axis away from the robot.
_DOWN: Final = (0.0, 2.0**-0.5, 0.0, 2.0**-0.5)


def locked(update: SceneUpdate, name: str, frame: str, when: Timestamp) -> SceneEntity:
    """Return a new entity that follows its frame."""
    return update.entities.add(id=name, frame_id=frame, timestamp=when, frame_locked=True)


def add_axis(entity: SceneEntity, colour: Colour) -> None:
    """Add an arrow from the origin against z."""
    arrow = entity.arrows.add(
        shaft_length=0.75 * _AXIS_LENGTH_M,
        shaft_diameter=0.03 * _AXIS_LENGTH_M,
        head_length=0.25 * _AXIS_LENGTH_M,
        head_diameter=0.1 * _AXIS_LENGTH_M,
    )
    turn = arrow.pose.orientation
    turn.x, turn.y, turn.z, turn.w = _DOWN
    _paint(arrow, colour)


def add_sphere(entity: SceneEntity, centre: Array, diameter: float, colour: Colour) -> None:
    """Add a sphere of some diameter [m] round ``centre`` (3,) [m]."""
    sphere = entity.spheres.add()
    sphere.pose.orientation.w = 1.0
    sphere.pose.position.x, sphere.pose.position.y, sphere.pose.position.z = centre.tolist()
    sphere.size.x = sphere.size.y = sphere.size.z = diameter
    _paint(sphere, colour)


def add_text(entity: SceneEntity, text: str, at: Array, colour: Colour) -> None:
    """Add a text that faces the viewer, at ``at`` (3,) [m]."""
    written = entity.texts.add(billboard=True, font_size=12.0, scale_invariant=True, text=text)
    written.pose.orientation.w = 1.0
    written.pose.position.x, written.pose.position.y, written.pose.position.z = at.tolist()
    _paint(written, colour)


def add_line(entity: SceneEntity, kind: Any, points: Array, thickness: float, colour: Colour) -> None:
    """Add a line of some thickness [m] through ``points`` (n, 3) [m]: ``STRIP``, ``LOOP`` or ``PAIRS``."""
    line = entity.lines.add(type=kind, thickness=thickness)
    line.pose.orientation.w = 1.0
    _paint(line, colour)
    for x, y, z in on_grid(points):
        line.points.add(x=x, y=y, z=z)


def on_grid(points: Array) -> Sequence[Sequence[float]]:
    """Return points (n, 3) [m] as rows, on the grid of all drawings."""
    rows: Sequence[Sequence[float]] = (np.round(points * _GRID) / _GRID).tolist()
    return rows


def _paint(primitive: Any, colour: Colour) -> None:
    primitive.color.r, primitive.color.g, primitive.color.b, primitive.color.a = *colour, 1.0
