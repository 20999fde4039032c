"""The 3-D scene of viewers (foxglove.SceneUpdate): what moves, and what stands still in its frame.

=================  ==================================================================  ====================
topic              entities                                                            written
=================  ==================================================================  ====================
``/scene/static``  rings, end axis, wanted end in their frames on ``/tf``; wanted path  once
``/scene``         rods, springs, cables coloured by tension                            <= 10 Hz
=================  ==================================================================  ====================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.geometry import CableHoles, LogGeometry
from tcrctl.robot.module import rings
from tcrctl.signals import Array

WORLD: Final = "world"
REFERENCE: Final = "reference"
"""Coordinate frame of the wanted end on ``/tf``."""

Colour = tuple[float, float, float]

_RING_SEGMENTS: Final = 24
_RING_THICKNESS_M: Final = 0.003
_ROD_THICKNESS_M: Final = 0.002
_SPRING_THICKNESS_M: Final = 0.0012
_CABLE_THICKNESS_M: Final = 0.001
_PATH_THICKNESS_M: Final = 0.0008
_AXIS_LENGTH_M: Final = 0.09
_GRID: Final = 2.0**13  # coordinates are multiples of 0.12 mm: less than a pixel, and half the bytes
_GREY: Final = (0.6, 0.6, 0.6)
_DARK: Final = (0.25, 0.25, 0.25)
_GREEN: Final = (0.0, 0.62, 0.45)
_ORANGE: Final = (0.95, 0.55, 0.1)
_BLUE: Final = (0.34, 0.71, 0.91)
#: Turns x to -z: arrows point along x, the end axis away from the robot.
_DOWN: Final = (0.0, 2.0**-0.5, 0.0, 2.0**-0.5)


class Scene:
    """Encodes scenes of one robot."""

    def __init__(self, geometry: LogGeometry) -> None:
        """Prepare for a robot with this ``geometry``."""
        self._geometry = geometry
        self._rods = geometry.rods.ravel().tolist()
        self._springs = geometry.springs.ravel()

    def encode(self, nodes: Array, tension: Array, when: Timestamp) -> bytes:
        """Serialise the SceneUpdate of what moves.

        Args:
            nodes: Node positions (n_nodes, 3) [m].
            tension: Cable tensions (m,) [N].
            when: Time of the step.
        """
        update = SceneUpdate()
        robot = update.entities.add(id="rods", frame_id=WORLD, timestamp=when)
        _line(robot, LinePrimitive.LINE_LIST, nodes, _ROD_THICKNESS_M, _DARK)
        robot.lines[0].indices.extend(self._rods)
        if self._springs.size:
            springs = update.entities.add(id="springs", frame_id=WORLD, timestamp=when)
            _line(springs, LinePrimitive.LINE_LIST, nodes[self._springs], _SPRING_THICKNESS_M, _GREEN)
        for cable, newton in zip(self._geometry.cables, tension.tolist(), strict=False):
            self._draw_cable(update, cable, newton, nodes, when)
        return update.SerializeToString()

    def encode_static(self, nodes: Array, with_axis: bool, when: Timestamp) -> bytes:
        """Serialise the SceneUpdate of what never changes in its frame.

        Args:
            nodes: Node positions of any shape (n_nodes, 3) [m]; only the radii of the rings matter.
            with_axis: Whether an orientation of the end is wanted, so that it has an axis to be drawn.
            when: Time of the step.
        """
        update = SceneUpdate()
        for i, (name, corners) in enumerate(zip(self._geometry.ring_names, rings(nodes), strict=True)):
            radius = float(np.linalg.norm(corners[0] - corners.mean(axis=0)))
            is_tip = i == self._geometry.tip_ring
            ring = _locked(update, f"ring {name}", name, when)
            _line(
                ring,
                LinePrimitive.LINE_LOOP,
                _circle(radius),
                _RING_THICKNESS_M,
                _ORANGE if is_tip else _GREY,
            )
            if is_tip:
                _axis(ring, _ORANGE)
        wanted = _locked(update, "wanted end", REFERENCE, when)
        _sphere(wanted, _BLUE)
        if with_axis:
            _axis(wanted, _BLUE)
        if len(self._geometry.reference_path):
            path = update.entities.add(id="wanted path", frame_id=WORLD, timestamp=when)
            _line(path, LinePrimitive.LINE_STRIP, self._geometry.reference_path, _PATH_THICKNESS_M, _BLUE)
        return update.SerializeToString()

    def _draw_cable(
        self, update: SceneUpdate, cable: CableHoles, tension: float, nodes: Array, when: Timestamp
    ) -> None:
        share = min(1.0, max(0.0, tension / self._geometry.full_scale_tension))
        colour = (round(share, 3), 0.1, round(1.0 - share, 3))
        entity = update.entities.add(id=f"cable {cable.name}", frame_id=WORLD, timestamp=when)
        _line(entity, LinePrimitive.LINE_STRIP, cable.points(nodes), _CABLE_THICKNESS_M, colour)


def _locked(update: SceneUpdate, name: str, frame: str, when: Timestamp) -> SceneEntity:
    """Return the entity that follows its frame."""
    return update.entities.add(id=name, frame_id=frame, timestamp=when, frame_locked=True)


def _circle(radius: float) -> Array:
    angle = 2.0 * np.pi * np.arange(_RING_SEGMENTS) / _RING_SEGMENTS
    return radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def _axis(entity: SceneEntity, colour: Colour) -> None:
    arrow = entity.arrows.add(
        shaft_length=0.75 * _AXIS_LENGTH_M,
        shaft_diameter=0.03 * _AXIS_LENGTH_M,
        head_length=0.25 * _AXIS_LENGTH_M,
        head_diameter=0.1 * _AXIS_LENGTH_M,
    )
    turn = arrow.pose.orientation
    turn.x, turn.y, turn.z, turn.w = _DOWN
    _paint(arrow, colour)


def _sphere(entity: SceneEntity, colour: Colour) -> None:
    sphere = entity.spheres.add()
    sphere.pose.orientation.w = 1.0
    sphere.size.x = sphere.size.y = sphere.size.z = 0.006
    _paint(sphere, colour)


def _line(entity: SceneEntity, kind: Any, points: Array, thickness: float, colour: Colour) -> None:
    line = entity.lines.add(type=kind, thickness=thickness)
    line.pose.orientation.w = 1.0
    _paint(line, colour)
    rows: Sequence[Sequence[float]] = (np.round(points * _GRID) / _GRID).tolist()
    for x, y, z in rows:
        line.points.add(x=x, y=y, z=z)


def _paint(primitive: Any, colour: Colour) -> None:
    primitive.color.r, primitive.color.g, primitive.color.b, primitive.color.a = *colour, 1.0
