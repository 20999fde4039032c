"""Topics derived from a step for viewers: frames, end poses, backbone and a 3-D scene.

Nothing here is data: the end's poses are rounded to 1 um, frames to 15 um, the scene to 0.12 mm, which is far below
what a screen shows and lets the compressor remove most of it. Where a shape is not finite (a diverged or unseen
robot), nothing is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.geometry import LogGeometry
from tcrctl.log.kept_messages import kept_backbone, kept_frames, kept_pose
from tcrctl.log.ring_frames import drawable, quaternion_of_normal, ring_frames
from tcrctl.log.scene import REFERENCE, Scene
from tcrctl.robot.module import ring_nodes, rings
from tcrctl.signals import Array, Measurement, Reference, StepRecord

TOPICS: Final[dict[str, Any]] = {
    "/tf": FrameTransforms,
    "/tip/measured": PoseInFrame,
    "/tip/reference": PoseInFrame,
    "/backbone": PosesInFrame,
    "/scene": SceneUpdate,
    "/scene/static": SceneUpdate,
}
VIEWER_RATE_HZ: Final = 20.0
SCENE_RATE_HZ: Final = 5.0


def stride(period: float, rate_hz: float) -> int:
    """Return steps between two messages so that no more than ``rate_hz`` of them appear per second."""
    return max(1, int(np.ceil(1.0 / (rate_hz * period) - 1e-9)))


def stamp(time_ns: int) -> Timestamp:
    """Return the Protobuf timestamp of an instant in Unix nanoseconds."""
    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


_FINE: Final = 2.0**20
_COARSE: Final = 2.0**16
_TURN: Final = 2.0**14


def rounded(values: Array, grid: float) -> list[list[float]]:
    """Return the rows of ``values`` in multiples of 1 / ``grid``."""
    rows: list[list[float]] = (np.round(values * grid) / grid).tolist()
    return rows


class ViewerTopics:
    """Makes the messages of the derived topics of one log.

    Shape and tensions are those of the simulated truth where a step has it, else of the estimate.
    """

    def __init__(self, geometry: LogGeometry, period: float) -> None:
        """Prepare for steps of ``period`` [s] of a robot with this ``geometry``."""
        self._geometry = geometry
        self._viewer_stride = stride(period, VIEWER_RATE_HZ)
        self._scene_stride = stride(period, SCENE_RATE_HZ)
        self._scene = Scene(geometry)
        self._static_written = False
        self._frames = kept_frames(geometry.ring_names)
        self._frames_and_wanted = kept_frames((*geometry.ring_names, REFERENCE))
        self._backbone, self._tip = kept_backbone(len(geometry.ring_names)), kept_pose()
        marker_of = {node: row for row, node in enumerate(geometry.marker_nodes)}
        tip = ring_nodes(geometry.tip_ring)
        self._tip_markers = (
            [marker_of[node] for node in tip] if all(node in marker_of for node in tip) else None
        )

    def messages(self, record: StepRecord, time_ns: int) -> Iterator[tuple[str, bytes]]:
        """Return the topic and encoded message of everything due at this step, whose log time is ``time_ns``."""
        when = stamp(time_ns)
        if record.k % self._viewer_stride == 0:
            yield from self._poses(record, when)
        if self._static_written and record.k % self._scene_stride:
            return
        nodes = self._nodes(record)
        if nodes is not None:
            if not self._static_written:
                yield "/scene/static", self.static(record, nodes, when)
            yield "/scene", self._scene.encode(nodes, _tension(record), when)

    def static(self, record: StepRecord, nodes: Array, when: Timestamp) -> bytes:
        """Encode what stands still in its frame, for nodes (n_nodes, 3) [m] of the step."""
        self._static_written = True
        return self._scene.encode_static(nodes, record.reference.normal is not None, when)

    def _nodes(self, record: StepRecord) -> Array | None:
        """Return the node positions (n_nodes, 3) [m] if the step has a shape that can be drawn."""
        shape = _drawn(record)
        return shape.reshape(-1, 3) if shape.size == 3 * self._geometry.n_nodes and drawable(shape) else None

    def _poses(self, record: StepRecord, when: Timestamp) -> Iterator[tuple[str, bytes]]:
        nodes, tip = self._nodes(record), self._measured_tip(record.measurement)
        corners = [part for part in (None if nodes is None else rings(nodes), tip) if part is not None]
        centre, turn = (
            ring_frames(np.concatenate(corners)) if corners else (np.zeros((0, 3)), np.zeros((0, 4)))
        )
        count = 0 if nodes is None else len(self._geometry.ring_names)
        reference = _reference(record.reference)
        if nodes is not None and drawable(centre[:count], turn[:count]):
            yield from self._shape(centre[:count], turn[:count], reference, when)
        if tip is not None and drawable(centre[count:], turn[count:]):
            fine = rounded(centre[count:], _FINE), rounded(turn[count:], _FINE)
            yield "/tip/measured", self._tip.encode(*fine, when)
        if reference is not None:
            fine = rounded(reference.position[None], _FINE), rounded(reference.turn[None], _FINE)
            yield "/tip/reference", self._tip.encode(*fine, when)

    def _shape(
        self, centre: Array, turn: Array, reference: _Wanted | None, when: Timestamp
    ) -> Iterator[tuple[str, bytes]]:
        places, turns = rounded(centre, _COARSE), rounded(turn, _TURN)
        if reference is None:
            yield "/tf", self._frames.encode(places, turns, when)
        else:
            wanted = rounded(reference.position[None], _COARSE), rounded(reference.turn[None], _TURN)
            both = places + wanted[0], turns + wanted[1]
            yield "/tf", self._frames_and_wanted.encode(*both, when)
        yield "/backbone", self._backbone.encode(places, turns, when)

    def _measured_tip(self, measurement: Measurement) -> Array | None:
        """Return the three markers of the end ring (1, 3, 3) [m], None if one of them was not seen."""
        rows = self._tip_markers
        if rows is None or max(rows) >= len(measurement.nodes) or not measurement.valid[rows].all():
            return None
        return measurement.nodes[rows].astype(np.float64)[None]


class _Wanted(NamedTuple):
    """Wanted end: position (3,) [m] and quaternion x, y, z, w (4,)."""

    position: Array
    turn: Array


def _drawn(record: StepRecord) -> Array:
    return record.estimate.q if record.truth is None else record.truth.q


def _tension(record: StepRecord) -> Array:
    return record.estimate.tension if record.truth is None else record.truth.tension


def _reference(reference: Reference) -> _Wanted | None:
    normal = np.array([0.0, 0.0, 1.0]) if reference.normal is None else reference.normal
    if reference.position.size != 3 or normal.size != 3 or not drawable(reference.position, normal):
        return None
    return _Wanted(reference.position, quaternion_of_normal(normal))
