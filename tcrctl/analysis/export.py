"""A log for tools that do not read MCAP: as a table (CSV, Parquet) or as arrays (npz, MATLAB).

Columns of a table are those of :mod:`tcrctl.analysis.table`; a table has a second one beside it for the events,
``run.events.csv`` beside ``run.csv``. Files of arrays keep quantities whole: ``estimate_position_m`` is
(n_steps, 3), ``measurement_nodes_m`` (n_steps, n_markers, 3); they also have ``node_names``, ``cable_names``,
``marker_names`` and the events. Numbers in CSV are the shortest that read back as the same bits; bools are 0 and 1.
Parquet has the columns of CSV in their own types, unit and meaning in the metadata of each. Where a lean step has
no full state, numbers are NaN.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.table import ERRORS, UNIT_SUFFIX, Series, errors, table
from tcrctl.errors import InputError, LogError
from tcrctl.experiment.run_folder import make_folder_for
from tcrctl.log.columns import COLUMNS
from tcrctl.log.reader import Log, read_log
from tcrctl.regular_file import other_kind
from tcrctl.visible import cell

#: Formats, which are also suffixes.
TABLES: Final = ("csv", "parquet")
ARRAYS: Final = ("npz", "mat")
_NAMES: Final = ("node_names", "cable_names", "marker_names")
#: MATLAB knows no longer names.
_MATLAB_NAME: Final = 63


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written.

    Attributes:
        files: The files; the events of a table are in the second.
        names: Columns of the table, or arrays.
    """

    files: tuple[Path, ...]
    names: tuple[str, ...]


def export_log(
    path: str | os.PathLike[str],
    form: str,
    out: str | os.PathLike[str],
    *,
    nodes: bool = False,
    ahead: bool = False,
    force: bool = False,
) -> Exported:
    """Write the steps and the events of a log.

    Args:
        path: The log, finished or not.
        form: One of ``TABLES`` or ``ARRAYS``.
        out: File to create.
        nodes: Tables: also every node's coordinates, velocities, forces and markers.
        ahead: Tables: also what is wanted at the instants that the controller looks ahead to.
        force: Replace files that exist.

    Raises:
        InputError: If ``path`` is not a log, a file exists and ``force`` is False, or pyarrow is not installed.
        DeviceError: If the folder of ``out`` cannot be made.
        LogError: If the log is damaged or a file cannot be written.
    """
    write = _parquet() if form == "parquet" else _FORMS[form]
    target, log = Path(out), read_log(path)
    if kind := other_kind(target):
        raise InputError(f"{target}: this is {kind}, not a file", hint="-o - is standard output, for --csv.")
    make_folder_for(target)
    if form in ARRAYS:
        arrays = _arrays(log)
        _write(target, write, arrays, force)
        return Exported((target,), tuple(arrays))
    steps, events = table(log, nodes=nodes, ahead=ahead), _events(log)
    beside = target.with_name(f"{target.stem}.events{target.suffix}")
    existing = [] if force else [file for file in (target, beside) if file.exists()]
    if existing:
        raise _exists(existing[0])
    _write(target, write, steps, force)
    _write(beside, write, events, force)
    return Exported((target, beside), tuple(steps))


def print_steps(
    path: str | os.PathLike[str], stream: TextIO, *, nodes: bool = False, ahead: bool = False
) -> None:
    """Write the steps of a log as CSV to an open stream; see `export_log`.

    Raises:
        InputError: If ``path`` is not a log.
        LogError: If the log is damaged.
    """
    _write_csv(
        stream, table(read_log(path), nodes=nodes, ahead=ahead), "\n"
    )  # streams spell the end of a line


def _events(log: Log) -> dict[str, Series]:
    """Return the events as a table, in their order."""
    found = list(log.events())
    said = {
        "t_s": ([event.t for event in found], np.float64, "s", "Time on the clock of the steps."),
        "kind": ([event.kind for event in found], np.str_, "", "Short name for machines."),
        "level": ([event.level for event in found], np.str_, "", "debug, info, warning, error or fatal."),
        "message": ([event.message for event in found], np.str_, "", "What happened, for a person."),
    }
    return {
        name: Series(np.array(values, kind), unit, meaning)
        for name, (values, kind, unit, meaning) in said.items()
    }


def _arrays(log: Log) -> dict[str, Any]:
    """Return every quantity as one array, first axis = step; the names of their components; the events."""
    columns = log.columns()
    arrays: dict[str, Any] = {
        name + UNIT_SUFFIX.get(COLUMNS[name].unit, ""): values for name, values in columns.items()
    }
    for name, values in errors(columns).items():
        arrays[name + UNIT_SUFFIX[ERRORS[name][0]]] = values
    for name in _NAMES:
        arrays[name] = np.array(getattr(log, name), dtype=np.str_)
    return arrays | {f"events_{name}": series.values for name, series in _events(log).items()}


def _write(out: Path, write: Callable[[Any, Any], None], content: Mapping[str, Any], force: bool) -> None:
    binary = write is not _write_csv
    mode = ("w" if force else "x") + ("b" if binary else "")
    try:
        with open(out, mode, newline=None if binary else "", encoding=None if binary else "utf-8") as stream:
            write(stream, content)
    except FileExistsError as error:
        raise _exists(out) from error
    except OSError as error:
        raise LogError(out, f"cannot be written: {error.strerror or error}") from error


def _exists(out: Path) -> InputError:
    return InputError(f"{out}: exists already", hint="Give another name with -o, or --force.")


def _write_csv(stream: Any, content: Mapping[str, Series], end: str = "\r\n") -> None:
    writer = csv.writer(stream, lineterminator=end)
    writer.writerow(map(cell, content))
    writer.writerows(zip(*(_cells(series.values) for series in content.values()), strict=True))


def _cells(values: NDArray[Any]) -> Sequence[Any]:
    if values.dtype.kind == "U":
        return [cell(text) for text in values.tolist()]
    cells: list[Any] = (values.astype(np.int8) if values.dtype == np.bool_ else values).tolist()
    return cells


def _parquet() -> Callable[[Any, Mapping[str, Series]], None]:
    """Return what writes Parquet."""
    try:
        pyarrow: Any = import_module("pyarrow")
        parquet: Any = import_module("pyarrow.parquet")
    except ImportError as error:
        hint = "pip install 'tcrctl[parquet]'"
        raise InputError("Parquet needs the package pyarrow, which is not installed", hint=hint) from error

    def write(stream: Any, content: Mapping[str, Series]) -> None:
        held = pyarrow.table({name: series.values for name, series in content.items()})
        fields = [
            field.with_metadata({"unit": series.unit, "meaning": series.meaning})
            for field, series in zip(held.schema, content.values(), strict=True)
        ]
        parquet.write_table(held.cast(pyarrow.schema(fields)), stream)

    return write


def _write_npz(stream: Any, content: Mapping[str, Any]) -> None:
    np.savez_compressed(stream, **content)


def _write_mat(stream: Any, content: Mapping[str, Any]) -> None:
    scipy_io: Any = import_module("scipy.io")
    held = {
        name[:_MATLAB_NAME]: values.astype(object) if values.dtype.kind == "U" else values
        for name, values in content.items()
    }
    scipy_io.savemat(stream, held, long_field_names=True, do_compression=True, oned_as="column")


_FORMS: Final[Mapping[str, Callable[[Any, Any], None]]] = {
    "csv": _write_csv,
    "npz": _write_npz,
    "mat": _write_mat,
}
