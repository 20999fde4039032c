"""Topics derived from a step for viewers: frames, end poses, backbone and a 3-D scene.

Nothing here is data: the end's poses are rounded to 1 um, frames to 15 um, the scene to 0.12 mm, which is far below
what a screen shows and lets the compressor remove most of it. Where a shape is not finite (a diverged or unseen
robot), nothing is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.geometry import LogGeometry
from tcrctl.log.ring_frames import drawable, quaternion_of_normal, ring_frames
from tcrctl.log.scene import REFERENCE, WORLD, Scene
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


Pose = tuple[Array, Array]
"""Position (3,) [m] and quaternion x, y, z, w (4,)."""


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
        shape = _shape(record)
        return shape.reshape(-1, 3) if shape.size == 3 * self._geometry.n_nodes and drawable(shape) else None

    def _poses(self, record: StepRecord, when: Timestamp) -> Iterator[tuple[str, bytes]]:
        nodes, reference = self._nodes(record), _reference(record.reference)
        if nodes is not None:
            centre, turn = ring_frames(rings(nodes))
            if drawable(centre, turn):
                yield "/tf", self._frames(centre, turn, reference, when)
                yield "/backbone", _backbone(centre, turn, when)
        measured = self._measured(record.measurement)
        if measured is not None:
            yield "/tip/measured", _pose(*measured, when)
        if reference is not None:
            yield "/tip/reference", _pose(*reference, when)

    def _frames(self, centre: Array, turn: Array, reference: Pose | None, when: Timestamp) -> bytes:
        names = list(self._geometry.ring_names)
        if reference is not None:
            names.append(REFERENCE)
            centre, turn = np.vstack([centre, reference[0]]), np.vstack([turn, reference[1]])
        message = FrameTransforms()
        rows = zip(names, rounded(centre, _COARSE), rounded(turn, _TURN), strict=True)
        for name, (x, y, z), (i, j, k, w) in rows:
            frame = message.transforms.add(parent_frame_id=WORLD, child_frame_id=name, timestamp=when)
            frame.translation.x, frame.translation.y, frame.translation.z = x, y, z
            frame.rotation.x, frame.rotation.y, frame.rotation.z, frame.rotation.w = i, j, k, w
        return message.SerializeToString()

    def _measured(self, measurement: Measurement) -> Pose | None:
        """Return the pose of the end ring from its three markers, None if one of them was not seen."""
        rows = self._tip_markers
        if rows is None or max(rows) >= len(measurement.nodes) or not measurement.valid[rows].all():
            return None
        centre, turn = ring_frames(measurement.nodes[rows].astype(np.float64)[None])
        return (centre[0], turn[0]) if drawable(centre, turn) else None


def _shape(record: StepRecord) -> Array:
    return record.estimate.q if record.truth is None else record.truth.q


def _tension(record: StepRecord) -> Array:
    return record.estimate.tension if record.truth is None else record.truth.tension


def _reference(reference: Reference) -> Pose | None:
    normal = np.array([0.0, 0.0, 1.0]) if reference.normal is None else reference.normal
    if reference.position.size != 3 or normal.size != 3 or not drawable(reference.position, normal):
        return None
    return reference.position, quaternion_of_normal(normal)


def _pose(position: Array, turn: Array, when: Timestamp) -> bytes:
    message = PoseInFrame(timestamp=when, frame_id=WORLD)
    _set_pose(message.pose, *rounded(position[None], _FINE), *rounded(turn[None], _FINE))
    return message.SerializeToString()


def _backbone(centre: Array, turn: Array, when: Timestamp) -> bytes:
    message = PosesInFrame(timestamp=when, frame_id=WORLD)
    for position, rotation in zip(rounded(centre, _COARSE), rounded(turn, _TURN), strict=True):
        _set_pose(message.poses.add(), position, rotation)
    return message.SerializeToString()


def _set_pose(pose: Any, position: list[float], turn: list[float]) -> None:
    pose.position.x, pose.position.y, pose.position.z = position
    pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w = turn
