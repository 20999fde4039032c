"""MODELDEF, versions 2.5 to 4.4 [NN24]: the names behind the numbers of a frame.

A list of descriptions in any order, each with its type and, from 4.1 on, its size in bytes. Only what names
markers is kept; force plates, devices and cameras are read over.

The size decides. A description that does not end there is tried in the other layout that has sizes, since a server
that streams an older version may describe in its own. What is longer than both is read as far as it is known, if
that gives names; else it is refused if it should name markers, and passed over if not. Nothing may follow the last.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from tcr_hardware.natnet.errors import MalformedPacketError
from tcr_hardware.natnet.models import Description, MarkerName, ModelDefinitions
from tcr_hardware.natnet.protocol import Version
from tcr_hardware.natnet.reader import Reader

#: Names in one packet: 200 rigid bodies of 8 markers are about 5000.
MOST_NAMES = 6000
#: From here on descriptions have sizes, and from there on rigid bodies an orientation against their parents.
SIZED, TURNED = Version(4, 1), Version(4, 2)
_BODY = struct.Struct("<ii3f")
_PLATE = struct.Struct("<2f3f144f12f2i")
_MARKER = struct.Struct("<i3ffh")


@dataclass(slots=True)
class _Found:
    descriptions: list[Description] = field(default_factory=list)
    cameras: list[str] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)

    @property
    def names(self) -> bool:
        """Whether a marker has a name."""
        return any(each.markers for each in self.descriptions)

    def extend(self, other: _Found) -> None:
        """Take over what was found in one description."""
        self.descriptions += other.descriptions
        self.cameras += other.cameras


def decode_models(payload: bytes, version: Version) -> ModelDefinitions:
    """Decode the payload of MODELDEF.

    Raises:
        MalformedPacketError: The payload does not have the layout of ``version``, or holds an unknown kind of
            description whose size is not given.
    """
    reader, found = Reader(payload, MOST_NAMES), _Found()
    sized = version >= SIZED
    for _ in range(reader.items("descriptions", 8 if sized else 4)):
        kind = reader.integer()
        if sized:
            _sized(reader, kind, version, found)
        elif kind in _KINDS:
            _KINDS[kind](reader, version, found)
        else:
            raise reader.fail(f"unknown description type {kind}")
    if reader.remaining:
        raise reader.fail(f"{reader.remaining} bytes behind the last description")
    return ModelDefinitions(tuple(found.descriptions), tuple(found.cameras), tuple(found.skipped))


def _sized(reader: Reader, kind: int, version: Version, found: _Found) -> None:
    """Read one description of which the size is told."""
    part = reader.part(reader.integer())
    if kind not in _KINDS:
        found.skipped.append(kind)
    else:
        _read_part(part, kind, version, found)
    reader.resume(part)


def _read_part(part: Reader, kind: int, version: Version, found: _Found) -> None:
    """Read a description as its version has it, or as the other version with sizes.

    Raises:
        MalformedPacketError: It should name markers and ends elsewhere, without having named any.
    """
    entry, problem = _attempt(part, kind, version)
    if problem is not None:
        other, why_not = _attempt(part, kind, SIZED if version >= TURNED else TURNED)
        if why_not is None or (other.names and not entry.names):
            entry, problem = other, why_not
    if problem is None or entry.names:
        found.extend(entry)
    elif kind in _NAMING:
        raise problem
    else:
        found.skipped.append(kind)


def _attempt(part: Reader, kind: int, layout: Version) -> tuple[_Found, MalformedPacketError | None]:
    """Return what a description says in one layout, and why that cannot be all."""
    reader, entry = part.part(part.remaining), _Found()
    try:
        _KINDS[kind](reader, layout, entry)
    except MalformedPacketError as error:
        return _Found(), error
    problem = (
        reader.fail(f"description of type {kind} ends at byte {reader.end}") if reader.remaining else None
    )
    return entry, problem


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
    if version >= TURNED:
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
#: Kinds without which markers would have no names.
_NAMING = (0, 1, 6)
