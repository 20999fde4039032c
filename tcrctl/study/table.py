"""The tidy table of a study: one row per run, one column per setting that varies and per measure.

Everything in it is the same whenever and wherever the runs were made, so two tables can be compared byte for byte;
what is of one run, seconds, log, time per step, is a table of its own beside it.
"""

from __future__ import annotations

import csv
import importlib
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.errors import DeviceError, InputError
from tcrctl.experiment.summary import UNITS
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import TIMING, Row
from tcrctl.visible import cell

#: Digits of an address in a table: enough that a million runs have different ones.
DIGITS: Final = 16
#: Numbers of every run, by dotted name.
RESULTS: Final = tuple(name for name in UNITS if name.partition(".")[0] not in TIMING)
Cell = str | int | float | bool | None


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under column names.

    Attributes:
        columns: The names.
        rows: As many values each.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def csv(self) -> str:
        """Return the table as comma-separated values: numbers with all digits, nothing for what is not there."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(map(cell, self.columns))
        writer.writerows([_text(value) for value in row] for row in self.rows)
        return stream.getvalue()

    def write_parquet(self, path: Path) -> None:
        """Write the table as Apache Parquet.

        Raises:
            InputError: If pyarrow is not installed.
            DeviceError: If the file cannot be written.
        """
        try:
            pyarrow: Any = importlib.import_module("pyarrow")
            parquet: Any = importlib.import_module("pyarrow.parquet")
        except ImportError:
            raise InputError(
                "--parquet needs pyarrow, which is not installed", hint="pip install 'tcrctl[parquet]'"
            ) from None
        columns = zip(self.columns, zip(*self.rows, strict=True), strict=True) if self.rows else ()
        try:
            parquet.write_table(pyarrow.table({name: _even(values) for name, values in columns}), path)
        except OSError as error:
            raise DeviceError(f"{path}: cannot be written: {error}") from error


def _text(value: Cell) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else cell(str(value))


def _even(values: Sequence[Cell]) -> list[Cell]:
    """Make values of one kind: numbers that are sometimes whole are all floats."""
    floats = any(isinstance(value, float) for value in values)
    return [float(v) if floats and isinstance(v, int) and not isinstance(v, bool) else v for v in values]


def tidy(runs: Sequence[PlannedRun], rows: Sequence[Row | None]) -> Table:
    """Return what is known of every run that is done.

    Args:
        runs: The runs in the order of the plan.
        rows: Their rows; None if one is not done.
    """
    done = [(run, row) for run, row in zip(runs, rows, strict=True) if row is not None]
    factors = list(dict.fromkeys(name for run, _ in done for name in run.levels))
    tasks = list(dict.fromkeys(name for _, row in done for name in _task_values(row)))
    paths = ["refused_paths"] if any(row.path for _, row in done) else []
    columns = ("run", *factors, "seed", "status", "criteria_met", *RESULTS, *tasks, *paths, "reason")
    return Table(columns, tuple(_line(run, row, factors, tasks, paths) for run, row in done))


def _line(
    run: PlannedRun, row: Row, factors: Sequence[str], tasks: Sequence[str], paths: Sequence[str]
) -> tuple[Cell, ...]:
    task = _task_values(row)
    return (
        run.address[:DIGITS],
        *(run.levels.get(name) for name in factors),
        run.seed,
        row.status,
        row.status == "success",
        *(_number(row.result, name) for name in RESULTS),
        *(task.get(name) for name in tasks),
        *(row.path.get("refused") for _ in paths),
        row.reason,
    )


def times(runs: Sequence[PlannedRun], rows: Sequence[Row | None]) -> Table:
    """Return what is of one run: seconds, time per step, log."""
    steps = ("p50", "p99", "max")
    columns = ("run", "seconds", *(f"control_ms.{name}" for name in steps), "log")
    lines = []
    for run, row in zip(runs, rows, strict=True):
        if row is not None:
            control = row.timing.get("control_ms") or {}
            lines.append((run.address[:DIGITS], row.seconds, *(control.get(name) for name in steps), row.log))
    return Table(columns, tuple(lines))


def _number(result: Mapping[str, Any], name: str) -> Cell:
    head, _, part = name.partition(".")
    value = result.get(head)
    found: Cell = value.get(part) if isinstance(value, Mapping) else value
    return found


def _task_values(row: Row) -> dict[str, Cell]:
    """Return numbers and flags of a task by dotted name."""
    return dict(_flat(row.result.get("task") or {}, "task"))


def _flat(value: Any, name: str) -> Iterator[tuple[str, Cell]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _flat(item, f"{name}.{key}")
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from _flat(item, f"{name}.{i}")
    elif isinstance(value, bool | int | float):
        yield name, value
