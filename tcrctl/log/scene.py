"""The 3-D scene of viewers (foxglove.SceneUpdate): what moves, and what stands still in its frame.

=================  ==================================================================  ====================
topic              entities                                                            written
=================  ==================================================================  ====================
``/scene/static``  rings, end axis, wanted end in frames on ``/tf``; wanted path; task  once
``/scene``         rods, springs, cables coloured by tension                            <= 10 Hz
=================  ==================================================================  ====================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.geometry import LogGeometry
from tcrctl.log.scene_primitives import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LOOP,
    ORANGE,
    PAIRS,
    STRIP,
    add_axis,
    add_line,
    add_sphere,
    locked,
    on_grid,
)
from tcrctl.log.task_scene import add_task
from tcrctl.robot.module import rings
from tcrctl.signals import Array

WORLD: Final = "world"
REFERENCE: Final = "reference"
"""Coordinate frame of the wanted end on ``/tf``."""

_RING_SEGMENTS: Final = 24
_RING_THICKNESS_M: Final = 0.003
_ROD_THICKNESS_M: Final = 0.002
_SPRING_THICKNESS_M: Final = 0.0012
_CABLE_THICKNESS_M: Final = 0.001
_PATH_THICKNESS_M: Final = 0.0008
_WANTED_M: Final = 0.006


class Scene:
    """Encodes scenes of one robot."""

    def __init__(self, geometry: LogGeometry) -> None:
        """Prepare for a robot with this ``geometry``."""
        self._geometry = geometry
        self._rods = geometry.rods.ravel().tolist()
        self._springs = geometry.springs.ravel()
        self._moving: dict[int, _Moving] = {}

    def encode(self, nodes: Array, tension: Array, when: Timestamp) -> bytes:
        """Serialise the SceneUpdate of what moves.

        Args:
            nodes: Node positions (n_nodes, 3) [m].
            tension: Cable tensions (m,) [N].
            when: Time of the step.
        """
        moving = self._moving.get(tension.size)
        if moving is None:
            moving = self._moving[tension.size] = self._drawn(nodes, tension)
        points = [nodes, nodes[self._springs], *(cable.points(nodes) for cable in self._geometry.cables)]
        moving.move(np.concatenate(points[: len(moving.cables) + 2]), when)
        for colour, newton in zip(moving.cables, tension.tolist(), strict=False):
            colour.r, _, colour.b = self._colour(newton)
        return moving.update.SerializeToString()

    def _drawn(self, nodes: Array, tension: Array) -> _Moving:
        update = SceneUpdate()
        robot = update.entities.add(id="rods", frame_id=WORLD)
        add_line(robot, PAIRS, nodes, _ROD_THICKNESS_M, DARK)
        robot.lines[0].indices.extend(self._rods)
        if self._springs.size:
            springs = update.entities.add(id="springs", frame_id=WORLD)
            add_line(springs, PAIRS, nodes[self._springs], _SPRING_THICKNESS_M, GREEN)
        fixed = len(update.entities)
        for cable, newton in zip(self._geometry.cables, tension.tolist(), strict=False):
            entity = update.entities.add(id=f"cable {cable.name}", frame_id=WORLD)
            add_line(entity, STRIP, cable.points(nodes), _CABLE_THICKNESS_M, self._colour(newton))
        lines = [entity.lines[0] for entity in update.entities]
        return _Moving(
            update,
            list(update.entities),
            [point for line in lines for point in line.points],
            [line.color for line in lines[fixed:]],
        )

    def _colour(self, tension: float) -> tuple[float, float, float]:
        share = min(1.0, max(0.0, tension / self._geometry.full_scale_tension))
        return round(share, 3), 0.1, round(1.0 - share, 3)

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
            ring = locked(update, f"ring {name}", name, when)
            add_line(
                ring,
                LOOP,
                _circle(radius),
                _RING_THICKNESS_M,
                ORANGE if is_tip else GREY,
            )
            if is_tip:
                add_axis(ring, ORANGE)
        wanted = locked(update, "wanted end", REFERENCE, when)
        add_sphere(wanted, np.zeros(3), _WANTED_M, BLUE)
        if with_axis:
            add_axis(wanted, BLUE)
        if len(self._geometry.reference_path):
            path = update.entities.add(id="wanted path", frame_id=WORLD, timestamp=when)
            add_line(path, STRIP, self._geometry.reference_path, _PATH_THICKNESS_M, BLUE)
        add_task(
            update, self._geometry.drawing, self._geometry.ring_names[self._geometry.tip_ring], WORLD, when
        )
        return update.SerializeToString()


class _Moving(NamedTuple):
    """A scene that is kept: to move its points costs a quarter of making it.

    Attributes:
        update: The message.
        entities: Its entities.
        points: The points of all lines, in their order.
        cables: Colours of the cables.
    """

    update: SceneUpdate
    entities: Sequence[Any]
    points: Sequence[Any]
    cables: Sequence[Any]

    def move(self, points: Array, when: Timestamp) -> None:
        """Set all points (n, 3) [m] and the time."""
        for entity in self.entities:
            entity.timestamp.CopyFrom(when)
        for point, (x, y, z) in zip(self.points, on_grid(points), strict=True):
            point.x, point.y, point.z = x, y, z


def _circle(radius: float) -> Array:
    angle = 2.0 * np.pi * np.arange(_RING_SEGMENTS) / _RING_SEGMENTS
    return radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
