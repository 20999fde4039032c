"""Steps as columns: one array per quantity, named after its path in the record.

``estimate.position`` of :class:`tcrctl.signals.StepRecord` is column ``estimate_position`` with shape
(n_steps, 3); ``truth.q`` is ``truth_q``, and so on for every field of every record. Units are those of the
record, all SI (:data:`COLUMNS`). Where a step has no value (no normal in position-only tracking, fewer
prediction instants than others, no full state in a lean step, no camera frame in time) floats are NaN, integers -1,
bools False, texts empty. Columns of ``truth`` (simulated plants) and ``measurement.raw`` (rigs) exist only if a
step has them.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, is_dataclass
from typing import Any, Final, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import UnknownNameError
from tcrctl.log.schema import MESSAGES
from tcrctl.signals import StepRecord


@dataclass(frozen=True, slots=True)
class Column:
    """One quantity of a step.

    Attributes:
        path: Dotted path in the record.
        kind: Kind of :class:`tcrctl.log.schema.Field`.
        unit: Unit; empty if there is none.
        width: Last dimension of a two-dimensional quantity, else 0.
    """

    path: str
    kind: str
    unit: str
    width: int

    @property
    def field(self) -> str:
        """Last part of the path."""
        return self.path.rpartition(".")[2]


#: An entry under "Attributes:" in a docstring, with the lines that continue it.
_ATTRIBUTE: Final = re.compile(r"^    (\w+): (.*(?:\n      .*)*)", re.MULTILINE)
_NO_QUANTITIES: Final = ("checksums", "marker_planes", "marker_changes")


def _columns(message: str = "Step", prefix: str = "") -> dict[str, Column]:
    found: dict[str, Column] = {}
    for field in MESSAGES[message]:
        if field.name in _NO_QUANTITIES:
            continue
        path = prefix + field.name
        if field.kind in MESSAGES:
            found |= _columns(field.kind, path + ".")
        else:
            found[path.replace(".", "_")] = Column(path, field.kind, field.unit, field.width)
    return found


COLUMNS: Final = _columns()
"""Every column by name."""

OPTIONAL: Final = ("truth", "measurement.raw")
"""Records that a step may lack."""


def meanings(record: type = StepRecord, prefix: str = "") -> dict[str, str]:
    """Say what every column is, by name: the words of :mod:`tcrctl.signals`; empty where those say nothing."""
    said = dict(_ATTRIBUTE.findall(inspect.cleandoc(record.__doc__ or "")))
    found: dict[str, str] = {}
    for name, kind in get_type_hints(record).items():
        inner = next((part for part in (kind, *get_args(kind)) if is_dataclass(part)), None)
        if name in _NO_QUANTITIES:
            continue
        if isinstance(inner, type):
            found |= meanings(inner, f"{prefix}{name}_")
        elif prefix + name in COLUMNS:  # a record may tell more than a log
            found[prefix + name] = " ".join(said.get(name, "").split())
    return found


_DTYPES: Final[dict[str, Any]] = {
    "double": np.float64,
    "double[]": np.float64,
    "float[]": np.float32,
    "bool": np.bool_,
    "bool[]": np.bool_,
    "int32[]": np.int32,
    "uint64": np.int64,
    "int64": np.int64,
}


def stack(steps: Iterable[StepRecord], names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """Stack steps into columns.

    Args:
        steps: The steps.
        names: Which columns; all if None.

    Returns:
        Array by column name, first axis = step.

    Raises:
        UnknownNameError: If a name is not in ``COLUMNS``.
    """
    wanted = list(COLUMNS) if names is None else list(names)
    for name in wanted:
        if name not in COLUMNS:
            raise UnknownNameError("log column", name, list(COLUMNS))
    values: dict[str, list[Any]] = {name: [] for name in wanted}
    paths = {name: COLUMNS[name].path.split(".") for name in wanted}
    for step in steps:
        for name, path in paths.items():
            values[name].append(_value(step, path))
    return {
        name: _stacked(COLUMNS[name], column)
        for name, column in values.items()
        if not COLUMNS[name].path.startswith(OPTIONAL) or any(value is not None for value in column)
    }


def _value(step: StepRecord, path: list[str]) -> Any:
    """Return the value at a path; None if a record on the way is lacking."""
    value: Any = step
    for part in path:
        if value is None:
            return None
        value = getattr(value, part)
    return value


def _stacked(column: Column, values: list[Any]) -> NDArray[Any]:
    if column.kind == "string":
        return np.array(["" if value is None else value for value in values], dtype=np.str_)
    dtype = _DTYPES[column.kind]
    if not column.kind.endswith("[]"):
        lacking = np.nan if dtype is np.float64 else -1
        return np.array([lacking if value is None else value for value in values], dtype=dtype)
    missing: NDArray[Any] = np.zeros((0, column.width) if column.width else 0, dtype)
    arrays = [missing if value is None else value for value in values]
    lengths = {len(array) for array in arrays}
    if len(lengths) == 1 and lengths != {0}:
        return np.stack(arrays)
    return _padded(arrays, max(lengths, default=0), _longest_empty(column), dtype)


def _longest_empty(column: Column) -> tuple[int, ...]:
    """Return the shape of a quantity no step has: a normal has three components even then."""
    if column.field == "normal":
        return (3,)
    return (0, column.width) if column.width else (0,)


def _padded(arrays: list[NDArray[Any]], length: int, least: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    shape = (max(length, least[0]), *least[1:])
    lacking = {np.bool_: False, np.int32: -1}.get(dtype, np.nan)
    result = np.full((len(arrays), *shape), lacking, dtype)
    for row, array in zip(result, arrays, strict=True):
        row[: len(array)] = array
    return result
