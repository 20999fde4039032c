"""The 3-D scene of viewers: rings, rods, and cables coloured by tension (foxglove.SceneUpdate)."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.geometry import NODES_PER_MODULE, CableRoute, LogGeometry
from tcrctl.signals import Array

_RING_SEGMENTS: Final = 24
_RING_THICKNESS_M: Final = 0.003
_ROD_THICKNESS_M: Final = 0.002
_CABLE_THICKNESS_M: Final = 0.001
_GRID: Final = 2.0**14  # coordinates are multiples of 0.06 mm: less than a pixel, and half the bytes


class Scene:
    """Encodes scenes of one robot.

    Rings are circles in their own frames on ``/tf`` and follow these between two scenes; their encoding never
    changes and is made once. Rods and cables are drawn in the world.
    """

    def __init__(self, geometry: LogGeometry) -> None:
        """Prepare for a robot with this ``geometry``."""
        self._geometry = geometry
        self._rods = geometry.rods.ravel().tolist()
        self._rings = b""

    def encode(self, nodes: Array, tension: Array, when: Timestamp) -> bytes:
        """Serialised SceneUpdate for node positions (n_nodes, 3) [m] and cable tensions (m,) [N]."""
        if not self._rings:
            self._rings = self._encode_rings(nodes, when)
        update = SceneUpdate()
        robot = update.entities.add(id="rods", frame_id="world", timestamp=when)
        _line(robot, LinePrimitive.LINE_LIST, nodes, _ROD_THICKNESS_M, (0.25, 0.25, 0.25))
        robot.lines[0].indices.extend(self._rods)
        for cable, newton in zip(self._geometry.cables, tension.tolist(), strict=False):
            self._draw_cable(update, cable, newton, nodes, when)
        # Concatenated messages of one type merge, and repeated entities then follow each other.
        return self._rings + update.SerializeToString()

    def _encode_rings(self, nodes: Array, when: Timestamp) -> bytes:
        update = SceneUpdate()
        angle = 2.0 * np.pi * np.arange(_RING_SEGMENTS) / _RING_SEGMENTS
        circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
        for i, name in enumerate(self._geometry.ring_names):
            corners = nodes[NODES_PER_MODULE * i : NODES_PER_MODULE * i + 3]
            radius = np.linalg.norm(corners[0] - corners.mean(axis=0))
            ring = update.entities.add(id=f"ring {name}", frame_id=name, timestamp=when, frame_locked=True)
            colour = (0.95, 0.55, 0.1) if i == self._geometry.tip_ring else (0.6, 0.6, 0.6)
            _line(ring, LinePrimitive.LINE_LOOP, radius * circle, _RING_THICKNESS_M, colour)
        return update.SerializeToString()

    def _draw_cable(
        self, update: SceneUpdate, cable: CableRoute, tension: float, nodes: Array, when: Timestamp
    ) -> None:
        share = min(1.0, max(0.0, tension / self._geometry.full_scale_tension))
        colour = (round(share, 3), 0.1, round(1.0 - share, 3))
        entity = update.entities.add(id=f"cable {cable.name}", frame_id="world", timestamp=when)
        _line(entity, LinePrimitive.LINE_STRIP, cable.points(nodes), _CABLE_THICKNESS_M, colour)


def _line(
    entity: SceneEntity, kind: Any, points: Array, thickness: float, colour: tuple[float, float, float]
) -> None:
    line = entity.lines.add(type=kind, thickness=thickness)
    line.pose.orientation.w = 1.0
    line.color.r, line.color.g, line.color.b, line.color.a = *colour, 1.0
    for x, y, z in (np.round(points * _GRID) / _GRID).tolist():
        line.points.add(x=x, y=y, z=z)
