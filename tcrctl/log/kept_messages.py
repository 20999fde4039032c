"""Messages for viewers of which only the numbers change: made once and filled at every step.

To fill a message that is there costs a quarter of making it; its bytes are the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from google.protobuf.timestamp_pb2 import Timestamp

from tcrctl.log.scene import WORLD

Rows = Sequence[Sequence[float]]


class KeptPoses:
    """A message with a number of poses in the world."""

    def __init__(self, message: Any, stamped: Sequence[Any], places: Sequence[tuple[Any, Any]]) -> None:
        """Keep a message.

        Args:
            message: The message.
            stamped: Its parts that have a time.
            places: Its positions and quaternions, pair by pair.
        """
        self._message, self._stamped, self._places = message, tuple(stamped), tuple(places)

    def encode(self, positions: Rows, turns: Rows, when: Timestamp) -> bytes:
        """Serialise it with positions [m] and quaternions x, y, z, w, one of each for every pose."""
        for part in self._stamped:
            part.timestamp.CopyFrom(when)
        for (position, turn), (x, y, z), (i, j, k, w) in zip(self._places, positions, turns, strict=True):
            position.x, position.y, position.z = x, y, z
            turn.x, turn.y, turn.z, turn.w = i, j, k, w
        data: bytes = self._message.SerializeToString()
        return data


def kept_frames(names: Sequence[str]) -> KeptPoses:
    """Return the frames of ``/tf``, all of them children of the world."""
    message = FrameTransforms()
    frames = [message.transforms.add(parent_frame_id=WORLD, child_frame_id=name) for name in names]
    return KeptPoses(message, frames, [(frame.translation, frame.rotation) for frame in frames])


def kept_backbone(count: int) -> KeptPoses:
    """Return the ``count`` poses of ``/backbone``."""
    message = PosesInFrame(frame_id=WORLD)
    poses = [message.poses.add() for _ in range(count)]
    return KeptPoses(message, [message], list(_places(poses)))


def kept_pose() -> KeptPoses:
    """Return the one pose of ``/tip/measured`` and ``/tip/reference``."""
    message = PoseInFrame(frame_id=WORLD)
    return KeptPoses(message, [message], list(_places([message.pose])))


def _places(poses: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    for pose in poses:
        yield pose.position, pose.orientation
