"""Digests of a step: what a lean step leaves out can be checked, and a change of what was given is noticed."""

from __future__ import annotations

import struct
import zlib
from operator import attrgetter
from typing import Any, Final

import numpy as np

from tcrctl.signals import Checksums, StepRecord

# Part of the file format: another list or order makes every log look changed.
_GIVEN: Final = attrgetter(
    "measurement.t",
    "measurement.nodes",
    "measurement.valid",
    "measurement.drive",
    "reference.t",
    "reference.position",
    "reference.normal",
    "reference.ahead_position",
    "reference.ahead_normal",
    "reference.drive",
)
_STATE: Final = attrgetter(
    "estimate.q", "estimate.v", "estimate.disturbance", "info.predicted_tension", "info.integral"
)


def checksums(step: StepRecord) -> Checksums:
    """Return the digests of a step that has its full state.

    Each is the CRC-32 (of zlib) over the little-endian numbers of its fields in the order above; a field that is
    None counts as the one byte 0xff.
    """
    return Checksums(_digest(_GIVEN(step)), _digest(_STATE(step)))


def _digest(values: tuple[Any, ...]) -> int:
    return zlib.crc32(b"".join(_bytes(value) for value in values))


def _bytes(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return b"\xff" if value is None else struct.pack("<d", value)
