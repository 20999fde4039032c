"""One frame of mocap data, as the server sent it: metres, its own axes, its own clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

Points: TypeAlias = NDArray[np.float32]  # (n, 3) [m]
Records: TypeAlias = NDArray[np.void]  # (n,) of MARKER or RIGID_BODY

#: A labelled marker, packed as from 3.0 on: identity, position [m], diameter [m], flags, residual [m].
MARKER = np.dtype(
    [("id", "<i4"), ("position", "<f4", 3), ("size", "<f4"), ("params", "<i2"), ("residual", "<f4")]
)
#: A rigid body, packed as from 3.0 on: position [m], quaternion (x, y, z, w), mean marker error [m], flags.
RIGID_BODY = np.dtype(
    [
        ("id", "<i4"),
        ("position", "<f4", 3),
        ("orientation", "<f4", 4),
        ("mean_error", "<f4"),
        ("params", "<i2"),
    ]
)

# Flags of a marker.
OCCLUDED = 0x01  # not seen; may still carry a position
POINT_CLOUD = 0x02  # position from the cameras
MODEL_FILLED = 0x04  # position computed from the rest of its asset
HAS_MODEL = 0x08
UNLABELLED = 0x10
ACTIVE = 0x20
# Flags of a rigid body.
TRACKED = 0x01
# Flags of a frame.
RECORDING = 0x01
MODELS_CHANGED = 0x02
EDIT_MODE = 0x04
BITSTREAM_CHANGED = 0x08


class MarkerSet(NamedTuple):
    """Positions of the markers of one asset, in the order of its definition."""

    name: str
    positions: Points


class BodyMarkers(NamedTuple):
    """Markers of one rigid body; only before 3.0."""

    positions: Points
    ids: NDArray[np.int32]
    sizes: NDArray[np.float32]


class Skeleton(NamedTuple):
    """Rigid bodies of one skeleton."""

    id: int
    rigid_bodies: Records


class Asset(NamedTuple):
    """Rigid bodies and markers of one trained marker set; from 4.1."""

    id: int
    rigid_bodies: Records
    markers: Records


class Analog(NamedTuple):
    """Samples of a force plate or device, one array per channel."""

    id: int
    channels: tuple[NDArray[np.float32], ...]


class Suffix(NamedTuple):
    """What stands at the end of a frame.

    Attributes:
        software_latency: What the vendor's headers call so; None from 3.0 on. Motive writes the time of the frame
            into it [s], so it says nothing about how old a frame is.
        timecode: SMPTE time code and sub-frame.
        timestamp: Time of the frame since the stream began [s]; None up to 2.5.
        mid_exposure: Server clock in the middle of the exposure [ticks]; 0 if unknown.
        received: Server clock when the camera data had arrived [ticks]; 0 if unknown.
        transmit: Server clock when the frame was sent [ticks]; 0 if unknown.
        precision: PTP time in seconds and fraction; zeros without it.
        params: Flags of the frame.
    """

    software_latency: float | None
    timecode: tuple[int, int]
    timestamp: float | None
    mid_exposure: int = 0
    received: int = 0
    transmit: int = 0
    precision: tuple[int, int] = (0, 0)
    params: int = 0


@dataclass(frozen=True, slots=True)
class MocapFrame:
    """One decoded frame. The arrays are read-only views of the packet.

    Attributes:
        number: Counted by the server.
        marker_sets: Positions by asset.
        unlabelled: Markers without a name (n, 3) [m].
        rigid_bodies: Records ``RIGID_BODY``, tracked or not.
        body_markers: Their markers, in the same order; empty from 3.0 on.
        skeletons: Bodies by skeleton.
        assets: Trained marker sets.
        markers: Records ``MARKER``: labelled markers and, from Motive 3 on, the unlabelled ones too.
        force_plates: Samples of force plates.
        devices: Samples of other devices.
        suffix: Clocks and flags.
    """

    number: int
    marker_sets: tuple[MarkerSet, ...]
    unlabelled: Points
    rigid_bodies: Records
    body_markers: tuple[BodyMarkers, ...]
    skeletons: tuple[Skeleton, ...]
    assets: tuple[Asset, ...]
    markers: Records
    force_plates: tuple[Analog, ...]
    devices: tuple[Analog, ...]
    suffix: Suffix

    def has(self, flag: int) -> bool:
        """Tell whether the server set a flag of the frame, for instance ``MODELS_CHANGED``."""
        return bool(self.suffix.params & flag)


def records(dtype: np.dtype[Any], count: int) -> Records:
    """Make ``count`` records filled with zeros."""
    return np.zeros(count, dtype)
