"""Records of :mod:`tcrctl.signals` to protobuf bytes and back, bit for bit."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tcrctl.log.event import Event
from tcrctl.log.schema import MESSAGES, OPAQUE, SCALARS, Field, wire_class
from tcrctl.signals import (
    Checksums,
    Command,
    ControlInfo,
    Estimate,
    Measurement,
    RawFrame,
    Reference,
    StepRecord,
    Timing,
    Truth,
)

_RECORDS: Final[dict[str, type]] = {
    "Step": StepRecord,
    "Reference": Reference,
    "Measurement": Measurement,
    "RawFrame": RawFrame,
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
    "int32[]": np.dtype("<i4"),
}

Fields: TypeAlias = frozenset[tuple[str, str]]
"""Fields of message types, each as name of the type and of the field."""


def encode(name: str, record: object) -> bytes:
    """Encode a record as message type ``name`` (a key of :data:`tcrctl.log.schema.MESSAGES`).

    Raises:
        ValueError: If an array has another dtype or dimension than the schema says; a silent cast would make
            the log differ from what the controller saw.
    """
    return bytes(filled(name, record).SerializeToString())


def filled(name: str, record: object, omitted: Fields = frozenset()) -> Any:
    """Return the message of type ``name`` with the values of a record, but those of the fields ``omitted``.

    Raises:
        ValueError: As :func:`encode`.
    """
    message = _WIRE[name]()
    _fill(message, name, record, omitted)
    return message


def _fill(message: Any, name: str, record: object, omitted: Fields) -> None:
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
    return record_of(parsed(name, data), name)


def parsed(name: str, data: bytes) -> Any:
    """Return the message of type ``name``, arrays as bytes.

    Raises:
        google.protobuf.message.DecodeError: If ``data`` is not such a message.
    """
    return _WIRE[name].FromString(data)


def decode_event(data: bytes) -> Event:
    """Decode a ``/tcrctl/event`` message."""
    event: Event = decode("Event", data)
    return event


def record_of(message: Any, name: str) -> Any:
    """Record with the values of a parsed message of type ``name``.

    Raises:
        ValueError: If an array in it is no whole number of values.
    """
    values = {field.name: _value(message, field) for field in MESSAGES[name] if field.kind != OPAQUE}
    return _RECORDS[name](**values)


def _value(message: Any, field: Field) -> Any:
    if field.optional and not message.HasField(field.name):
        return None
    value: Any = getattr(message, field.name)
    if field.kind in SCALARS:
        return value
    if field.kind not in _DTYPES:
        return record_of(value, field.kind)
    array: NDArray[Any] = np.frombuffer(value, _DTYPES[field.kind]).copy()
    return array.reshape(-1, field.width) if field.width else array
