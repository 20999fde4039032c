"""Records of :mod:`tcrctl.signals` to protobuf bytes and back, bit for bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.log.checksums import checksums
from tcrctl.log.event import Event
from tcrctl.log.schema import MESSAGES, OPAQUE, SCALARS, SPARSE, Field, wire_class
from tcrctl.signals import (
    Checksums,
    Command,
    ControlInfo,
    Estimate,
    Measurement,
    Reference,
    StepRecord,
    Timing,
    Truth,
)

_RECORDS: Final[dict[str, type]] = {
    "Step": StepRecord,
    "Reference": Reference,
    "Measurement": Measurement,
    "Estimate": Estimate,
    "Command": Command,
    "ControlInfo": ControlInfo,
    "Truth": Truth,
    "Timing": Timing,
    "Checksums": Checksums,
    "Event": Event,
}
_WIRE: Final = {name: wire_class(name) for name in MESSAGES}
_PYTHON: Final = {"double": float, "uint64": int, "int64": int, "bool": bool, "string": str}
_DTYPES: Final[dict[str, np.dtype[Any]]] = {
    "double[]": np.dtype("<f8"),
    "float[]": np.dtype("<f4"),
    "bool[]": np.dtype(np.bool_),
}
_NOTHING: Final[frozenset[tuple[str, str]]] = frozenset()
_LEAN: Final = SPARSE | {("Measurement", "nodes")}


def encode(name: str, record: object) -> bytes:
    """Encode a record as message type ``name`` (a key of :data:`tcrctl.log.schema.MESSAGES`).

    Raises:
        ValueError: If an array has another dtype or dimension than the schema says; a silent cast would make
            the log differ from what the controller saw.
    """
    message = _WIRE[name]()
    _fill(message, name, record)
    return bytes(message.SerializeToString())


def encode_step(step: StepRecord, *, full: bool = True) -> bytes:
    """Encode a step with its checksums, in full or lean; see :mod:`tcrctl.log.schema`.

    Args:
        step: The step, with its full state.
        full: Write the full state too.

    Raises:
        ValueError: As :func:`encode`.
    """
    message = _WIRE["Step"]()
    _fill(message, "Step", step, _NOTHING if full else _LEAN)
    _fill(message.checksums, "Checksums", checksums(step))
    if not full:
        message.marker_planes = planes(step.measurement.nodes)
    return bytes(message.SerializeToString())


def planes(nodes: NDArray[np.float32]) -> bytes:
    """Bytes of all coordinates (n, 3) by significance, the lowest of all first: (4, 3 n)."""
    return np.ascontiguousarray(nodes, "<f4").view(np.uint8).reshape(-1, 4).T.tobytes()


def from_planes(data: bytes) -> NDArray[np.float32]:
    """Inverse of :func:`planes`.

    Raises:
        ValueError: If the number of bytes does not make whole markers.
    """
    sorted_bytes = np.frombuffer(data, np.uint8).reshape(4, -1)
    return np.ascontiguousarray(sorted_bytes.T).view("<f4").reshape(-1, 3)


def _fill(message: Any, name: str, record: object, omitted: frozenset[tuple[str, str]] = _NOTHING) -> None:
    for field in MESSAGES[name]:
        if field.kind == OPAQUE or (name, field.name) in omitted:
            continue
        value = getattr(record, field.name)
        if value is None and field.optional:
            continue
        if field.kind in SCALARS:
            setattr(message, field.name, _PYTHON[field.kind](value))
        elif field.kind in _DTYPES:
            setattr(message, field.name, _array_bytes(name, field, value))
        else:
            child = getattr(message, field.name)
            child.SetInParent()
            _fill(child, field.kind, value, omitted)


def _array_bytes(name: str, field: Field, value: NDArray[Any]) -> bytes:
    wanted = _DTYPES[field.kind]
    shape_fits = value.ndim == 2 and value.shape[1] == field.width if field.width else value.ndim == 1
    if value.dtype != wanted or not shape_fits:
        shape = f"(n, {field.width})" if field.width else "(n,)"
        raise ValueError(
            f"{name}.{field.name} is {value.dtype} {value.shape}, the log holds {wanted} {shape}"
        )
    return value.tobytes()


def decode(name: str, data: bytes) -> Any:
    """Decode a message of type ``name``; fields that the file lacks are empty or zero, optional ones None.

    Raises:
        google.protobuf.message.DecodeError: If ``data`` is not such a message.
    """
    return _record(_WIRE[name].FromString(data), name)


def decode_step(data: bytes) -> StepRecord:
    """Decode a ``/tcrctl/step`` message; its arrays are writable copies, equal bit for bit.

    Arrays that a lean step leaves out are empty.

    Raises:
        google.protobuf.message.DecodeError: If ``data`` is not such a message.
        ValueError: If an array in it is no whole number of values.
    """
    message = _WIRE["Step"].FromString(data)
    step: StepRecord = _record(message, "Step")
    if not message.marker_planes:
        return step
    return replace(step, measurement=replace(step.measurement, nodes=from_planes(message.marker_planes)))


def decode_event(data: bytes) -> Event:
    """Decode a ``/tcrctl/event`` message."""
    event: Event = decode("Event", data)
    return event


def _record(message: Any, name: str) -> Any:
    values = {field.name: _value(message, field) for field in MESSAGES[name] if field.kind != OPAQUE}
    return _RECORDS[name](**values)


def _value(message: Any, field: Field) -> Any:
    if field.optional and not message.HasField(field.name):
        return None
    value: Any = getattr(message, field.name)
    if field.kind in SCALARS:
        return value
    if field.kind not in _DTYPES:
        return _record(value, field.kind)
    array: NDArray[Any] = np.frombuffer(value, _DTYPES[field.kind]).copy()
    return array.reshape(-1, field.width) if field.width else array
