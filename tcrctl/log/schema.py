"""Protobuf schema of the log, built at run time from the table below, so no protoc and no generated code.

Every message type exists twice with the same wire format. The *public* one, stored in the file for viewers,
declares an array as ``repeated double``. The *wire* one, used by our codec, declares the same field number as
``bytes``: a packed repeated field and a bytes field are both length-delimited, so an array is copied whole,
NaN payloads included, instead of number by number.

A step is written *in full* or *lean*. A lean step leaves out the fields of ``SPARSE``: node positions, velocities
and forces, which replay computes again, and of which it holds digests (``checksums``). Its markers are input
and cannot be left out; they are in ``marker_planes`` or ``marker_changes`` instead of ``measurement.nodes``, in a
form that the compressor can shorten by a third (:mod:`tcrctl.log.steps`). How often a step is full is
``log.full_state_s``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import Descriptor, FileDescriptor

PACKAGE: Final = "tcrctl.v1"
VERSION: Final = "1"

_Proto = descriptor_pb2.FieldDescriptorProto
SCALARS: Final = {
    "double": _Proto.TYPE_DOUBLE,
    "uint64": _Proto.TYPE_UINT64,
    "int64": _Proto.TYPE_INT64,
    "bool": _Proto.TYPE_BOOL,
    "string": _Proto.TYPE_STRING,
}
#: Not an attribute of a record: another form of what the record holds, written and read by the codec alone.
OPAQUE: Final = "bytes"
ARRAYS: Final = {
    "double[]": _Proto.TYPE_DOUBLE,
    "float[]": _Proto.TYPE_FLOAT,
    "bool[]": _Proto.TYPE_BOOL,
    "int32[]": _Proto.TYPE_SFIXED32,
}


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message type.

    Attributes:
        name: Attribute name in the record of :mod:`tcrctl.signals`.
        kind: A key of ``SCALARS``, of ``ARRAYS``, ``OPAQUE``, or the name of a message type.
        unit: Unit; empty if there is none.
        width: Second dimension of a two-dimensional array, 0 for one-dimensional ones.
        optional: True if the value may be None.
    """

    name: str
    kind: str
    unit: str = ""
    width: int = 0
    optional: bool = False


_COMMAND = (Field("speed", "double[]", "m/s"), Field("drive", "double[]", "m"))

# Field numbers are positions in these tuples: append only, never reorder, or old logs become unreadable.
MESSAGES: Final[dict[str, tuple[Field, ...]]] = {
    "Reference": (
        Field("t", "double", "s"),
        Field("position", "double[]", "m"),
        Field("normal", "double[]", "1", optional=True),
        Field("ahead_position", "double[]", "m", width=3),
        Field("ahead_normal", "double[]", "1", width=3, optional=True),
        Field("drive", "double[]", "m", optional=True),
    ),
    "Measurement": (
        Field("t", "double", "s"),
        Field("nodes", "float[]", "m", width=3),
        Field("valid", "bool[]"),
        Field("drive", "double[]", "m"),
        Field("raw", "RawFrame", optional=True),
    ),
    "RawFrame": (
        Field("number", "uint64"),
        Field("session", "uint64"),
        Field("delay", "double", "s"),
        Field("ids", "int32[]"),
        Field("positions", "float[]", "m", width=3),
        Field("flags", "int32[]"),
        Field("names", "string", optional=True),
    ),
    "Estimate": (
        Field("t", "double", "s"),
        Field("q", "double[]", "m"),
        Field("v", "double[]", "m/s"),
        Field("drive", "double[]", "m"),
        Field("tension", "double[]", "N"),
        Field("position", "double[]", "m"),
        Field("normal", "double[]", "1"),
        Field("disturbance", "double[]", "N"),
        Field("converged", "bool"),
    ),
    "Command": _COMMAND,
    "ControlInfo": (
        Field("converged", "bool"),
        Field("iterations", "int64"),
        Field("residual", "double", "N"),
        Field("lcp_residual", "double"),
        Field("lcp_pivots", "int64"),
        Field("saturated", "bool[]"),
        Field("predicted_tension", "double[]", "N"),
        Field("integral", "double[]", "m, 1"),
        Field("reason", "string"),
    ),
    "Truth": (
        Field("position", "double[]", "m"),
        Field("normal", "double[]", "1"),
        Field("tension", "double[]", "N"),
        Field("q", "double[]", "m"),
    ),
    "Timing": (
        Field("read", "double", "s"),
        Field("estimate", "double", "s"),
        Field("control", "double", "s"),
        Field("write", "double", "s"),
        Field("lateness", "double", "s"),
    ),
    "Step": (
        Field("k", "uint64"),
        Field("t", "double", "s"),
        Field("period", "double", "s"),
        Field("reference", "Reference"),
        Field("measurement", "Measurement"),
        Field("estimate", "Estimate"),
        Field("wanted", "Command"),
        Field("applied", "Command"),
        Field("info", "ControlInfo"),
        Field("truth", "Truth", optional=True),
        Field("timing", "Timing"),
        Field("checksums", "Checksums", optional=True),
        Field("marker_planes", "bytes"),
        Field("marker_changes", "bytes"),
    ),
    "Checksums": (
        Field("given", "uint64"),
        Field("state", "uint64"),
    ),
    "Event": (
        Field("t", "double", "s"),
        Field("kind", "string"),
        Field("level", "string"),
        Field("message", "string"),
    ),
}

SPARSE: Final = frozenset(
    {
        ("Estimate", "q"),
        ("Estimate", "v"),
        ("Estimate", "disturbance"),
        ("ControlInfo", "predicted_tension"),
        ("ControlInfo", "integral"),
        ("Truth", "q"),
    }
)
"""Message type and field of what a lean step leaves out; the arrays are then empty."""


def _add_field(message: descriptor_pb2.DescriptorProto, number: int, field: Field, *, wire: bool) -> None:
    proto = message.field.add(name=field.name, number=number, label=_Proto.LABEL_OPTIONAL)
    if field.kind in SCALARS:
        proto.type = SCALARS[field.kind]
    elif field.kind == OPAQUE:
        proto.type = _Proto.TYPE_BYTES
    elif field.kind not in ARRAYS:
        proto.type, proto.type_name = _Proto.TYPE_MESSAGE, f".{PACKAGE}.{field.kind}"
    elif wire:
        proto.type = _Proto.TYPE_BYTES
    else:
        proto.type, proto.label = ARRAYS[field.kind], _Proto.LABEL_REPEATED


def _pool(*, wire: bool) -> descriptor_pool.DescriptorPool:
    """Fill a pool with every message type; in proto2's wire form, where a field knows whether it is present."""
    file = descriptor_pb2.FileDescriptorProto(
        name="tcrctl/v1/log.proto", package=PACKAGE, syntax="proto2" if wire else "proto3"
    )
    for name, fields in MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, field in enumerate(fields, start=1):
            _add_field(message, number, field, wire=wire)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return pool


_PUBLIC = _pool(wire=False)
_WIRE = _pool(wire=True)


def public_descriptor(name: str) -> Descriptor:
    """Return the descriptor of message type ``name`` as stored in the file."""
    return _PUBLIC.FindMessageTypeByName(f"{PACKAGE}.{name}")


def wire_class(name: str) -> Any:
    """Return the message class of type ``name`` in which arrays are bytes; wire-compatible with the public one."""
    return message_factory.GetMessageClass(_WIRE.FindMessageTypeByName(f"{PACKAGE}.{name}"))


def descriptor_set(descriptor: Descriptor) -> bytes:
    """Serialise the FileDescriptorSet of a message type and all its imports: an MCAP ``protobuf`` schema."""
    files: dict[str, FileDescriptor] = {}

    def visit(file: FileDescriptor) -> None:
        for imported in file.dependencies:
            visit(imported)
        files.setdefault(file.name, file)

    visit(descriptor.file)
    result = descriptor_pb2.FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(result.file.add())
    return result.SerializeToString(deterministic=True)


def units(name: str = "Step", prefix: str = "") -> dict[str, str]:
    """Return the unit of every field of message type ``name`` that has one, by dotted path."""
    found: dict[str, str] = {}
    for field in MESSAGES[name]:
        if field.kind in MESSAGES:
            found |= units(field.kind, f"{prefix}{field.name}.")
        elif field.unit:
            found[prefix + field.name] = field.unit
    return found
