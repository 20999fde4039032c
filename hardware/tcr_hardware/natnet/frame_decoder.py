"""FRAMEOFDATA, versions 2.5 to 4.4 [NN24]: sections in fixed order, then a suffix of fixed length.

================  ============================================================  ======
section           element                                                       since
================  ============================================================  ======
marker sets       name, n, n positions
unlabelled        position
rigid bodies      id, position, quaternion, (before 3.0: n, n positions,
                  n ids, n sizes,) mean error, (from 2.6: flags)
skeletons         id, n, n rigid bodies                                         2.1
assets            id, n, n rigid bodies, m, m labelled markers                  4.1
labelled markers  id, position, size, (from 2.6: flags), (from 3.0: residual)   2.3
force plates      id, n channels of n samples                                   2.9
devices           as force plates                                               2.11
================  ============================================================  ======

Each section begins with the number of its elements and, from 4.1 on, the bytes that follow. From 4.1 to 4.4 nothing
has changed.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from tcr_hardware.natnet.frame import (
    MARKER,
    RIGID_BODY,
    Analog,
    Asset,
    BodyMarkers,
    MarkerSet,
    MocapFrame,
    Records,
    Skeleton,
    Suffix,
    records,
)
from tcr_hardware.natnet.protocol import NEWEST, Version
from tcr_hardware.natnet.reader import Reader

POINT = np.dtype(("<f4", 3))
_ID, _SAMPLE = np.dtype("<i4"), np.dtype("<f4")
_FLOAT = struct.Struct("<f")
_BODY = struct.Struct("<i3f4f")
_BODY_FLAGGED = struct.Struct("<fh")
_BODY_PACKED = struct.Struct("<i3f4ffh")  # RIGID_BODY
_MARKER_25 = np.dtype([("id", "<i4"), ("position", "<f4", 3), ("size", "<f4")])
_MARKER_26 = np.dtype([*_MARKER_25.descr, ("params", "<i2")])
_SUFFIX = (  # first version that has it, layout
    (Version(4, 1), struct.Struct("<IIdQQQIIhi")),
    (Version(3, 0), struct.Struct("<IIdQQQhi")),
    (Version(2, 7), struct.Struct("<fIIdhi")),
    (Version(2, 6), struct.Struct("<fIIfhi")),
    (Version(0, 0), struct.Struct("<fIIi")),
)


@dataclass(frozen=True, slots=True)
class Layout:
    """What differs between versions."""

    sized: bool
    newer: bool
    packed_bodies: bool
    body_flags: bool
    assets: bool
    marker: np.dtype[Any]
    force_plates: bool
    devices: bool
    suffix: struct.Struct


@lru_cache(maxsize=32)
def layout_of(version: Version) -> Layout:
    """Return a version's layout; after ``NEWEST`` that of ``NEWEST`` with longer elements and sections."""
    marker = MARKER if version >= (3, 0) else _MARKER_26 if version >= (2, 6) else _MARKER_25
    return Layout(
        sized=version >= (4, 1),
        newer=version > NEWEST,
        packed_bodies=version >= (3, 0),
        body_flags=version >= (2, 6),
        assets=version >= (4, 1),
        marker=marker,
        force_plates=version >= (2, 9),
        devices=version >= (2, 11),
        suffix=next(layout for since, layout in _SUFFIX if version >= since),
    )


def decode_frame(payload: bytes, version: Version) -> MocapFrame:
    """Decode the payload of FRAMEOFDATA.

    Raises:
        MalformedPacketError: The payload does not have the layout of ``version`` to the last byte.
    """
    layout, reader = layout_of(version), Reader(payload)
    number = reader.integer()
    marker_sets = _section(reader, layout, "marker sets", 5, _marker_set)
    unlabelled = _array_section(reader, layout, "unlabelled markers", POINT)
    rigid_bodies, body_markers = _rigid_body_section(reader, layout)
    skeletons = _section(reader, layout, "skeletons", 8, _skeleton)
    assets = _section(reader, layout, "assets", 12, _asset) if layout.assets else ()
    markers = _widened(_array_section(reader, layout, "labelled markers", layout.marker))
    plates = _section(reader, layout, "force plates", 8, _analog) if layout.force_plates else ()
    devices = _section(reader, layout, "devices", 8, _analog) if layout.devices else ()
    while layout.newer and reader.remaining > layout.suffix.size:
        _, size = reader.integer(), reader.integer()  # a section that we do not know
        reader.skip(size)
    suffix = _suffix(reader, layout)
    return MocapFrame(
        number,
        marker_sets,
        unlabelled,
        rigid_bodies,
        body_markers,
        skeletons,
        assets,
        markers,
        plates,
        devices,
        suffix,
    )


def _section_end(reader: Reader, layout: Layout) -> int | None:
    """Read where a section ends, if the version says so."""
    if not layout.sized:
        return None
    size = reader.integer()
    if not 0 <= size <= reader.remaining:
        raise reader.fail(f"section of {size} bytes does not fit")
    return reader.offset + size


def _leave(reader: Reader, layout: Layout, end: int | None, what: str) -> None:
    """Check that a section ended where it said; a newer version may have added something."""
    if end is None or end == reader.offset:
        return
    if reader.offset > end or not layout.newer:
        raise reader.fail(f"{what} end at byte {end}")
    reader.offset = end


def _section(reader: Reader, layout: Layout, what: str, smallest: int, element: Any) -> tuple[Any, ...]:
    """Read a section of elements of varying length."""
    count = reader.items(what, smallest)
    end = _section_end(reader, layout)
    found = tuple([element(reader, layout) for _ in range(count)])
    _leave(reader, layout, end, what)
    return found


def _array_section(reader: Reader, layout: Layout, what: str, dtype: np.dtype[Any]) -> Any:
    """Read a section of elements of one length."""
    count = reader.count(what, dtype.itemsize)
    end = _section_end(reader, layout)
    stride = None
    if layout.newer and end is not None and count:
        stride = (end - reader.offset) // count  # a newer version may have longer elements
    found = reader.array(dtype, count, stride)
    _leave(reader, layout, end, what)
    return found


def _marker_set(reader: Reader, layout: Layout) -> MarkerSet:
    name = reader.text()
    return MarkerSet(name, reader.array(POINT, reader.count("markers of a set", POINT.itemsize)))


def _rigid_body_section(reader: Reader, layout: Layout) -> tuple[Records, tuple[BodyMarkers, ...]]:
    if layout.packed_bodies:
        return _array_section(reader, layout, "rigid bodies", RIGID_BODY), ()
    return _bodies_with_markers(reader, layout)


def _rigid_bodies(reader: Reader, layout: Layout) -> Records:
    """Read the bodies within a skeleton or asset."""
    if layout.packed_bodies:
        return reader.array(RIGID_BODY, reader.count("rigid bodies", RIGID_BODY.itemsize))
    return _bodies_with_markers(reader, layout)[0]


def _bodies_with_markers(reader: Reader, layout: Layout) -> tuple[Records, tuple[BodyMarkers, ...]]:
    """Read rigid bodies before 3.0: each carries its markers."""
    count = reader.items("rigid bodies", _BODY.size + 8)
    packed = bytearray(count * RIGID_BODY.itemsize)
    markers = []
    start = 0
    for _ in range(count):
        head = reader.unpack(_BODY)
        n = reader.count("markers of a body", POINT.itemsize + 8)
        markers.append(BodyMarkers(reader.array(POINT, n), reader.array(_ID, n), reader.array(_SAMPLE, n)))
        mean_error, params = (
            reader.unpack(_BODY_FLAGGED) if layout.body_flags else (*reader.unpack(_FLOAT), 0)
        )
        _BODY_PACKED.pack_into(packed, start, *head, mean_error, params)
        start += _BODY_PACKED.size
    return np.frombuffer(bytes(packed), RIGID_BODY), tuple(markers)


def _skeleton(reader: Reader, layout: Layout) -> Skeleton:
    return Skeleton(reader.integer(), _rigid_bodies(reader, layout))


def _asset(reader: Reader, layout: Layout) -> Asset:
    asset_id, bodies = reader.integer(), _rigid_bodies(reader, layout)
    return Asset(asset_id, bodies, reader.array(MARKER, reader.count("asset markers", MARKER.itemsize)))


def _analog(reader: Reader, layout: Layout) -> Analog:
    analog_id, n = reader.integer(), reader.items("channels", 4)
    return Analog(analog_id, tuple([reader.array(_SAMPLE, reader.count("samples", 4)) for _ in range(n)]))


def _widened(markers: Records) -> Records:
    """Read labelled markers of any version as ``MARKER``; what the version lacks is 0."""
    if markers.dtype is MARKER:
        return markers
    wide = records(MARKER, len(markers))
    for name in markers.dtype.names or ():
        wide[name] = markers[name]
    wide.flags.writeable = False
    return wide


def _suffix(reader: Reader, layout: Layout) -> Suffix:
    """Read the end of the frame; it must be the end of the payload too."""
    if reader.remaining != layout.suffix.size:
        raise reader.fail(f"{reader.remaining} bytes left, the suffix has {layout.suffix.size}")
    *values, end_of_data = reader.unpack(layout.suffix)
    if end_of_data:
        raise reader.fail(f"end of data is {end_of_data}, not 0")
    if layout.packed_bodies:  # 3.0 on
        code, sub, timestamp, mid_exposure, received, transmit, *precision, params = values
        ptp = (precision[0], precision[1]) if precision else (0, 0)
        return Suffix(None, (code, sub), timestamp, mid_exposure, received, transmit, ptp, params)
    latency, code, sub, *rest = values
    timestamp, params = rest or (None, 0)
    return Suffix(latency, (code, sub), timestamp, params=params)
