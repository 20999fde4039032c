"""A log as a table (CSV, Parquet) or as arrays (npz), for tools that do not read MCAP.

Names are the column names of :mod:`tcrctl.log.columns` with the component, where there is one, and the SI
unit at the end: ``t_s``, ``estimate_position_x_m``, ``applied_speed_c1_m_s``, ``truth_tension_c3_n``,
``measurement_nodes_m7_n1_z_m``. An npz file keeps arrays whole: ``estimate_position_m`` is (n_steps, 3),
``measurement_nodes_m`` (n_steps, n_markers, 3); it also has ``node_names``, ``cable_names`` and
``marker_names``. Numbers in CSV are the shortest that read back as the same bits; bools are 0 and 1. Parquet has
the columns of CSV in their own types. Where a lean step has no full state, numbers are NaN.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import InputError, LogError
from tcrctl.log.columns import COLUMNS, Column
from tcrctl.log.reader import Log, read_log
from tcrctl.visible import cell

AXES: Final = ("x", "y", "z")
UNIT_SUFFIX: Final = {"m": "_m", "m/s": "_m_s", "N": "_n", "s": "_s"}
PER_NODE: Final = ("q", "v", "disturbance", "nodes", "valid")
PER_CABLE: Final = ("drive", "speed", "tension", "predicted_tension", "saturated")
PER_AXIS: Final = ("position", "normal", "ahead_position", "ahead_normal")


def export_csv(
    path: str | os.PathLike[str], out: str | os.PathLike[str], *, nodes: bool = False, force: bool = False
) -> list[str]:
    """Write one row per step and one column per number.

    Args:
        path: The log, finished or not.
        out: CSV file to create.
        nodes: Also write every node's coordinates, velocities, forces and markers.
        force: Replace ``out`` if it exists.

    Returns:
        The column names, in order.

    Raises:
        InputError: If ``path`` is not a log, or ``out`` exists and ``force`` is False.
        LogError: If the log is damaged or ``out`` cannot be written.
    """
    table = _table(read_log(path), nodes)
    with _create(Path(out), force) as stream:
        writer = csv.writer(stream)
        writer.writerow(map(cell, table))
        writer.writerows(zip(*(_cells(values) for values in table.values()), strict=True))
    return list(table)


def export_parquet(
    path: str | os.PathLike[str], out: str | os.PathLike[str], *, nodes: bool = False, force: bool = False
) -> list[str]:
    """Write one row per step and one column per number, as Apache Parquet.

    Args:
        path: The log, finished or not.
        out: Parquet file to create.
        nodes: As in :func:`export_csv`.
        force: Replace ``out`` if it exists.

    Returns:
        The column names, in order.

    Raises:
        InputError: If ``path`` is not a log, ``out`` exists and ``force`` is False, or pyarrow is not installed.
        LogError: If the log is damaged or ``out`` cannot be written.
    """
    try:
        pyarrow: Any = import_module("pyarrow")
        parquet: Any = import_module("pyarrow.parquet")
    except ImportError as error:
        hint = "pip install 'tcrctl[parquet]'"
        raise InputError("Parquet needs the package pyarrow, which is not installed", hint=hint) from error
    table = _table(read_log(path), nodes)
    with _create(Path(out), force, binary=True) as stream:
        parquet.write_table(pyarrow.table(table), stream)
    return list(table)


def export_npz(
    path: str | os.PathLike[str], out: str | os.PathLike[str], *, force: bool = False
) -> list[str]:
    """Write every quantity as one array, first axis = step.

    Args:
        path: The log, finished or not.
        out: npz file to create.
        force: Replace ``out`` if it exists.

    Returns:
        The array names.

    Raises:
        InputError: If ``path`` is not a log, or ``out`` exists and ``force`` is False.
        LogError: If the log is damaged or ``out`` cannot be written.
    """
    log = read_log(path)
    arrays: dict[str, Any] = {
        name + UNIT_SUFFIX.get(COLUMNS[name].unit, ""): values for name, values in log.columns().items()
    }
    for name in ("node_names", "cable_names", "marker_names"):
        arrays[name] = np.array(getattr(log, name), dtype=np.str_)
    with _create(Path(out), force, binary=True) as stream:
        np.savez_compressed(stream, **arrays)
    return list(arrays)


def _table(log: Log, nodes: bool) -> dict[str, NDArray[Any]]:
    """Return every number of every step, each (n_steps,), by full name."""
    wanted = [name for name, column in COLUMNS.items() if nodes or not _per_node(column)]
    table: dict[str, NDArray[Any]] = {}
    for name, values in log.columns(wanted).items():
        table |= _flat(name, values, log)
    return table


def _per_node(column: Column) -> bool:
    """Tell whether a quantity has so many numbers that a table is better off without."""
    raw = column.path.startswith("measurement.raw.") and column.kind.endswith("[]")
    return raw or column.field in PER_NODE


def _create(out: Path, force: bool, *, binary: bool = False) -> Any:
    mode = ("w" if force else "x") + ("b" if binary else "")
    try:
        return open(out, mode, newline=None if binary else "")
    except FileExistsError as error:
        raise InputError(f"{out}: exists already", hint="Give another name with -o, or --force.") from error
    except OSError as error:
        raise LogError(out, f"cannot be written: {error.strerror or error}") from error


def _flat(name: str, values: NDArray[Any], log: Log) -> dict[str, NDArray[Any]]:
    """Split a quantity into its numbers, each (n_steps,), by full name."""
    unit = UNIT_SUFFIX.get(COLUMNS[name].unit, "")
    if values.ndim == 1:
        return {name + unit: values}
    numbers = values.reshape(len(values), -1) if values.size else values.reshape(len(values), 0)
    if not len(values):  # how many numbers a step would have is not known
        return {f"{name}_{label}{unit}": values.reshape(-1) for label in AXES if values.shape[1:] == (3,)}
    labels = _labels(COLUMNS[name], values.shape[1:], log)
    return {f"{name}_{label}{unit}": numbers[:, i] for i, label in enumerate(labels)}


def _labels(column: Column, shape: tuple[int, ...], log: Log) -> list[str]:
    """Return the name of every component, in memory order; numbers where the log knows no names."""
    count = int(np.prod(shape))
    if column.field in PER_CABLE:
        labels = list(log.cable_names)
    elif column.field == "valid":
        labels = list(log.marker_names)
    elif column.field == "nodes":
        labels = _by_axis(log.marker_names)
    elif column.field in PER_NODE:
        labels = _by_axis(log.node_names)
    elif column.field in PER_AXIS:
        labels = list(AXES) if len(shape) == 1 else _by_axis(str(i) for i in range(shape[0]))
    else:
        labels = []
    names = labels if len(labels) == count else [str(i) for i in range(count)]
    return [name.replace(".", "_") for name in names]


def _by_axis(names: Iterable[str]) -> list[str]:
    return [f"{name}_{axis}" for name in names for axis in AXES]


def _cells(values: NDArray[Any]) -> list[Any]:
    cells: list[Any] = (values.astype(np.int8) if values.dtype == np.bool_ else values).tolist()
    return cells
