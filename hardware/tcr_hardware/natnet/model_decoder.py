"""MODELDEF, versions 2.5 to 4.3 [NN24]: the names behind the numbers of a frame.

A list of descriptions in any order, each with its type and, from 4.1 on, its size in bytes. Only what names
markers is kept; force plates, devices and cameras are read over.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from tcr_hardware.natnet.models import Description, MarkerName, ModelDefinitions
from tcr_hardware.natnet.protocol import Version
from tcr_hardware.natnet.reader import Reader

#: Names in one packet: 200 rigid bodies of 8 markers are about 5000.
MOST_NAMES = 6000
_BODY = struct.Struct("<ii3f")
_PLATE = struct.Struct("<2f3f144f12f2i")
_MARKER = struct.Struct("<i3ffh")


@dataclass(slots=True)
class _Found:
    descriptions: list[Description] = field(default_factory=list)
    cameras: list[str] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)


def decode_models(payload: bytes, version: Version) -> ModelDefinitions:
    """Decode the payload of MODELDEF.

    Raises:
        MalformedPacketError: The payload does not have the layout of ``version``, or holds an unknown kind of
            description whose size is not given.
    """
    reader, found = Reader(payload, MOST_NAMES), _Found()
    for _ in range(reader.items("descriptions", 8 if version >= (4, 1) else 4)):
        kind = reader.integer()
        size = reader.integer() if version >= (4, 1) else None
        read = _KINDS.get(kind)
        if read is not None:
            read(reader, version, found)
        elif size is not None:
            reader.skip(size)
            found.skipped.append(kind)
        else:
            raise reader.fail(f"unknown description type {kind}")
    return ModelDefinitions(tuple(found.descriptions), tuple(found.cameras), tuple(found.skipped))


def _marker_set(reader: Reader, version: Version, found: _Found) -> None:
    name = reader.text()
    names = [reader.text() for _ in range(reader.items("marker names", 1))]
    markers = tuple(MarkerName(marker, None) for marker in names)
    found.descriptions.append(Description("marker_set", name, None, markers))


def _rigid_body(reader: Reader, version: Version, found: _Found) -> None:
    found.descriptions.append(_body(reader, version))


def _body(reader: Reader, version: Version) -> Description:
    name = reader.text()
    body_id = reader.unpack(_BODY)[0]
    if version >= (4, 2):
        reader.skip(16)  # orientation against the parent
    if version < (3, 0):
        return Description("rigid_body", name, body_id, ())
    n = reader.items("markers of a body", 16)
    reader.skip(12 * n)  # offsets
    reader.skip(4 * n)  # active labels
    names = [reader.text() for _ in range(n)] if version >= (4, 0) else [""] * n
    markers = tuple(MarkerName(marker, _identity(body_id, k + 1)) for k, marker in enumerate(names))
    return Description("rigid_body", name, body_id, markers)


def _skeleton(reader: Reader, version: Version, found: _Found) -> None:
    name, skeleton_id = reader.text(), reader.integer()
    for _ in range(reader.items("bones", 21)):
        _body(reader, version)
    found.descriptions.append(Description("skeleton", name, skeleton_id, ()))


def _force_plate(reader: Reader, version: Version, found: _Found) -> None:
    reader.integer(), reader.text()
    reader.unpack(_PLATE)
    _channels(reader)


def _device(reader: Reader, version: Version, found: _Found) -> None:
    reader.integer(), reader.text(), reader.text()
    reader.skip(8)
    _channels(reader)


def _channels(reader: Reader) -> None:
    for _ in range(reader.items("channel names", 1)):
        reader.text()


def _camera(reader: Reader, version: Version, found: _Found) -> None:
    found.cameras.append(reader.text())
    reader.skip(28)  # position and orientation


def _asset(reader: Reader, version: Version, found: _Found) -> None:
    name = reader.text()
    reader.integer()
    asset_id = reader.integer()
    for _ in range(reader.items("bones", 21)):
        _body(reader, version)
    markers = []
    for _ in range(reader.items("asset markers", 1 + _MARKER.size)):
        marker = reader.text()
        number = reader.unpack(_MARKER)[0]
        # Both the full identity and the bare member number have been seen.
        markers.append(MarkerName(marker, number if number >> 16 else _identity(asset_id, number)))
    found.descriptions.append(Description("asset", name, asset_id, tuple(markers)))


def _identity(asset: int, member: int) -> int:
    """Return a marker's number in a frame: asset in the upper half, member (from 1) in the lower."""
    return (asset << 16) | (member & 0xFFFF)


_KINDS: dict[int, Callable[[Reader, Version, _Found], None]] = {
    0: _marker_set,
    1: _rigid_body,
    2: _skeleton,
    3: _force_plate,
    4: _device,
    5: _camera,
    6: _asset,
}
