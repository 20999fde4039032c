"""Steps to bytes and back, in full or lean; see :mod:`tcrctl.log.schema`.

Markers are noise in their lower two bytes and hardly move in their upper two. In a lean step they are therefore
written as integer differences to the step before, zigzag coded (0, -1, 1, -2, ...), and the bytes of all
differences sorted by significance: the upper two planes are nearly empty. The first lean step of a chunk is written
without a step before it, so that every chunk can be read without the others.

Truth and timing, which are nobody's input, are rounded to single precision in a lean step.
"""

from __future__ import annotations

from dataclasses import astuple, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.log.checksums import checksums
from tcrctl.log.codec import Fields, filled, parsed, record_of
from tcrctl.log.schema import SPARSE
from tcrctl.signals import StepRecord, Timing

_NOTHING: Final[Fields] = frozenset()
_LEAN: Final[Fields] = SPARSE | {("Measurement", "nodes")}


class StepEncoder:
    """Encodes the steps of one log in order."""

    def __init__(self, full_every: int = 1) -> None:
        """Write steps 0, ``full_every``, 2 ``full_every``, ... in full."""
        self._full_every = full_every
        self._before: StepRecord | None = None

    def restart(self) -> None:
        """Let the next step be readable without those before it."""
        self._before = None

    def encode(self, step: StepRecord) -> bytes:
        """Encode a step that has its full state, and add its checksums.

        Raises:
            ValueError: If an array has another dtype or dimension than the schema says.
        """
        full = step.k % self._full_every == 0
        message = filled("Step", step, _NOTHING) if full else filled("Step", _rounded(step), _LEAN)
        message.checksums.MergeFrom(filled("Checksums", checksums(step)))
        if not full:
            self._add_markers(message, step)
        self._before = step
        return bytes(message.SerializeToString())

    def _add_markers(self, message: Any, step: StepRecord) -> None:
        nodes, before = step.measurement.nodes, self._before
        if nodes.dtype != np.float32 or nodes.ndim != 2 or nodes.shape[1] != 3:
            raise ValueError(
                f"Measurement.nodes is {nodes.dtype} {nodes.shape}, the log holds float32 (n, 3)"
            )
        if before is not None and before.k == step.k - 1 and before.measurement.nodes.shape == nodes.shape:
            message.marker_changes = planes(zigzag(bits(nodes) - bits(before.measurement.nodes)))
        else:
            message.marker_planes = planes(bits(nodes))


class StepDecoder:
    """Decodes the steps of one log in order."""

    def __init__(self) -> None:
        self._before: StepRecord | None = None

    def decode(self, data: bytes) -> StepRecord | None:
        """Decode a step; arrays are writable, equal bit for bit, and empty if a lean step leaves them out.

        Returns:
            The step, or None if it cannot be told because the step before it, on which it builds, is missing.

        Raises:
            google.protobuf.message.DecodeError: If ``data`` is not such a message.
            ValueError: If an array in it is no whole number of values.
        """
        message = parsed("Step", data)
        step: StepRecord = record_of(message, "Step")
        if message.marker_planes:
            step = _with_markers(step, from_planes(message.marker_planes))
        elif message.marker_changes:
            if self._before is None or self._before.k != step.k - 1:
                return None
            changes = unzigzag(from_planes(message.marker_changes))
            step = _with_markers(step, bits(self._before.measurement.nodes) + changes)
        self._before = step
        return step


def _rounded(step: StepRecord) -> StepRecord:
    """Return the step with single precision where no controller has seen the numbers."""
    timing = Timing(*(_single(seconds) for seconds in astuple(step.timing)))
    truth = step.truth
    if truth is not None:
        truth = replace(
            truth,
            position=_single(truth.position),
            normal=_single(truth.normal),
            tension=_single(truth.tension),
        )
    return replace(step, timing=timing, truth=truth)


def _single(values: Any) -> Any:
    with np.errstate(over="ignore"):
        return np.asarray(values, np.float32).astype(np.float64)


def _with_markers(step: StepRecord, numbers: NDArray[np.int32]) -> StepRecord:
    nodes = numbers.view("<f4").reshape(-1, 3)
    return replace(step, measurement=replace(step.measurement, nodes=nodes))


def bits(nodes: NDArray[np.float32]) -> NDArray[np.int32]:
    """Return the bit patterns of floats (n, 3) as integers (3 n,)."""
    return np.ascontiguousarray(nodes, "<f4").reshape(-1).view("<i4")


def zigzag(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Map small numbers of either sign (n,) to small ones without: 0, -1, 1, -2 become 0, 1, 2, 3."""
    return (numbers << 1) ^ (numbers >> 31)


def unzigzag(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the inverse of :func:`zigzag`."""
    positive = numbers.view("<u4")
    signed: NDArray[np.int32] = (positive >> 1).astype("<i4") ^ -(positive & 1).astype("<i4")
    return signed


def planes(numbers: NDArray[np.int32]) -> bytes:
    """Return the bytes of integers (n,) by significance, the lowest of all first: (4, n)."""
    return numbers.view(np.uint8).reshape(-1, 4).T.tobytes()


def from_planes(data: bytes) -> NDArray[np.int32]:
    """Return the inverse of :func:`planes`.

    Raises:
        ValueError: If the number of bytes does not make whole numbers.
    """
    columns = np.frombuffer(data, np.uint8).reshape(4, -1)
    return np.ascontiguousarray(columns.T).reshape(-1).view("<i4")
