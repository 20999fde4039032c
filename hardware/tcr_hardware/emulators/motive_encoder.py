"""NatNet as a server writes it, versions 2.5 to 4.4 [NN24]: struct codes, nothing shared with the client."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.emulators.motive_markers import UNLABELLED, TrackedMarkers, View

Version = tuple[int, int]

MARKER_SIZE = 0.008
RESIDUAL = 0.0003


@dataclass(frozen=True, slots=True)
class Stamp:
    """Number, clocks and flags of one frame.

    Attributes:
        number: Frame number.
        timestamp: Time since the stream began [s].
        mid_exposure: Server clock [ticks].
        received: Server clock [ticks].
        transmit: Server clock [ticks].
        params: Flags.
    """

    number: int
    timestamp: float
    mid_exposure: int
    received: int
    transmit: int
    params: int


def packet(message: int, payload: bytes = b"") -> bytes:
    """Put the header before a payload."""
    return struct.pack("<HH", message, len(payload)) + payload


def text(value: str) -> bytes:
    """Encode a name with its closing zero."""
    return value.encode() + b"\0"


def sender(name: str, version: Version) -> bytes:
    """Encode who we are; behind the name lies garbage, as in the real thing."""
    return text(name).ljust(256, b"\xcd") + bytes((3, 1, 0, 0)) + bytes((*version, 0, 0))


def server_info(
    name: str, version: Version, clock_hz: int, data_port: int, multicast: bool, group: str
) -> bytes:
    """Encode the payload of SERVERINFO."""
    if version < (3, 0):
        return sender(name, version)
    address = bytes(int(part) for part in group.split("."))
    return sender(name, version) + struct.pack("<QHB", clock_hz, data_port, multicast) + address


def _section(version: Version, count: int, content: bytes = b"") -> bytes:
    """Encode count, from 4.1 size, and elements."""
    if version >= (4, 1):
        return struct.pack("<ii", count, len(content)) + content
    return struct.pack("<i", count) + content


def _points(positions: NDArray[np.float64]) -> bytes:
    return positions.astype("<f4").tobytes()


def _sets(version: Version, tracked: TrackedMarkers, view: View) -> bytes:
    sets = [(body.name, view.in_sets[body.rows]) for body in tracked.bodies] + [("all", view.in_sets)]
    out = [text(name) + struct.pack("<i", len(points)) + _points(points) for name, points in sets]
    return _section(version, len(out), b"".join(out))


def _bodies(version: Version, tracked: TrackedMarkers, view: View) -> bytes:
    out = []
    poses = zip(
        view.body_positions.tolist(), view.body_orientations.tolist(), view.body_tracked.tolist(), strict=True
    )
    for body, (position, orientation, is_tracked) in zip(tracked.bodies, poses, strict=True):
        content = struct.pack("<i3f4f", body.id, *position, *orientation)
        if version < (3, 0):
            n = len(body.rows)
            ids, sizes = range(1, n + 1), [MARKER_SIZE] * n
            content += struct.pack("<i", n) + _points(view.in_sets[body.rows])
            content += struct.pack(f"<{n}i{n}f", *ids, *sizes)
        content += struct.pack("<f", RESIDUAL)
        out.append(content + struct.pack("<h", is_tracked) if version >= (2, 6) else content)
    return _section(version, len(out), b"".join(out))


def _labelled(version: Version, view: View) -> bytes:
    out = []
    for number, position, params in zip(
        view.ids.tolist(), view.positions.tolist(), view.params.tolist(), strict=True
    ):
        if version >= (3, 0):
            out.append(struct.pack("<i3ffhf", number, *position, MARKER_SIZE, params, RESIDUAL))
        elif params == UNLABELLED:
            continue  # old servers list them as unlabelled only
        elif version >= (2, 6):
            out.append(struct.pack("<i3ffh", number, *position, MARKER_SIZE, params))
        else:
            out.append(struct.pack("<i3ff", number, *position, MARKER_SIZE))
    return _section(version, len(out), b"".join(out))


def _suffix(version: Version, stamp: Stamp) -> bytes:
    # Headers of the vendor call the first number of old suffixes a latency; Motive writes the time of the frame.
    out = struct.pack("<f", stamp.timestamp) if version < (3, 0) else b""
    out += struct.pack("<II", 0, 0)  # time code
    if version >= (2, 7):
        out += struct.pack("<d", stamp.timestamp)
    elif version >= (2, 6):
        out += struct.pack("<f", stamp.timestamp)
    if version >= (3, 0):
        out += struct.pack("<QQQ", stamp.mid_exposure, stamp.received, stamp.transmit)
    if version >= (4, 1):
        out += struct.pack("<II", 0, 0)  # no PTP clock
    if version >= (2, 6):
        out += struct.pack("<h", stamp.params)
    return out + struct.pack("<i", 0)


def frame(version: Version, stamp: Stamp, tracked: TrackedMarkers, view: View) -> bytes:
    """Encode the payload of FRAMEOFDATA."""
    out = [
        struct.pack("<i", stamp.number),
        _sets(version, tracked, view),
        _section(version, len(view.unlabelled), _points(view.unlabelled)),
        _bodies(version, tracked, view),
        _section(version, 0),  # skeletons
    ]
    if version >= (4, 1):
        out.append(_section(version, 0))  # assets
    out.append(_labelled(version, view))
    if version >= (2, 9):
        out.append(_section(version, 0))  # force plates
    if version >= (2, 11):
        out.append(_section(version, 0))  # devices
    return b"".join([*out, _suffix(version, stamp)])


def models(version: Version, tracked: TrackedMarkers) -> bytes:
    """Encode MODELDEF: a marker set and a rigid body for every body, the set of all, one camera from 3.0 on."""
    out = []
    for body in tracked.bodies:
        out.append((0, _set_description(body.name, body.markers)))
        offsets = tracked.rest[body.rows] - tracked.rest[body.rows].mean(axis=0)
        out.append((1, _body_description(version, body.name, body.id, body.markers, offsets)))
    out.append((0, _set_description("all", tracked.names)))
    if version >= (3, 0):
        out.append((5, text("Camera #1") + struct.pack("<3f4f", 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)))
    described = []
    for kind, description in out:
        size = struct.pack("<i", len(description)) if version >= (4, 1) else b""
        described.append(struct.pack("<i", kind) + size + description)
    return struct.pack("<i", len(described)) + b"".join(described)


def _set_description(name: str, markers: Iterable[str]) -> bytes:
    names = [text(marker) for marker in markers]
    return text(name) + struct.pack("<i", len(names)) + b"".join(names)


def _body_description(
    version: Version, name: str, number: int, markers: tuple[str, ...], offsets: NDArray[np.float64]
) -> bytes:
    out = text(name) + struct.pack("<ii3f", number, -1, 0.0, 0.0, 0.0)
    if version >= (4, 2):
        out += struct.pack("<4f", 0.0, 0.0, 0.0, 1.0)
    if version >= (3, 0):
        n = len(markers)
        out += struct.pack("<i", n) + _points(offsets) + struct.pack(f"<{n}i", *[0] * n)
    if version >= (4, 0):
        out += b"".join(text(marker) for marker in markers)
    return out
