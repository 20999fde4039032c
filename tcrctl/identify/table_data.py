"""Static data as a table (CSV): turned into the document that a YAML file of the same content would give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcrctl.config.budget import MAX_PROBLEMS
from tcrctl.config.csv_table import CsvTable, number_in
from tcrctl.config.keys import Keys
from tcrctl.config.strict_yaml import Document, placed, read
from tcrctl.errors import Problem, SpecError

_POINT = ("point", "x_mm", "y_mm", "z_mm")


def read_table(path: Path, cables: Sequence[str]) -> Document:
    """Read a table of measured points, one per row.

    Args:
        path: The file: comma-separated, UTF-8, one header line.
        cables: Names of the robot's cables.

    Raises:
        SpecError: If columns are missing or unknown, or a cell is no number; all problems are listed.
        InputError: If the file cannot be read.
    """
    table = CsvTable(read(path), str(path))
    drives = [f"drive_{name}_mm" for name in cables]
    _check_header(path, table, ["configuration", *drives, *_POINT])
    found, places, problems = _collect(path, table, drives)
    if problems:
        raise SpecError(problems[:MAX_PROBLEMS])
    return placed(str(path), {"configurations": list(found.values())}, places)


def _check_header(path: Path, table: CsvTable, wanted: list[str]) -> None:
    given, mark = table.header, table.separator
    if mark is not None:
        shown = "a tab" if mark == "\t" else mark
        raise SpecError([Problem(f"{path}:1:1", "", f"separated by {shown} where , is needed")])
    problems = [f"column {name!r} is missing" for name in wanted if name not in given]
    problems += [
        f"unknown column {name!r}; allowed: {', '.join(wanted)}" for name in given if name not in wanted
    ]
    problems += [
        f"column {name!r} stands there twice" for name in sorted({n for n in given if given.count(n) > 1})
    ]
    if problems:
        raise SpecError([Problem(f"{path}:1:1", "", message) for message in problems])


def _collect(
    path: Path, table: CsvTable, drives: list[str]
) -> tuple[dict[str, Any], dict[Keys, str], list[Problem]]:
    """Gather the rows of every configuration; a configuration's drives must agree in all of its rows."""
    found: dict[str, dict[str, Any]] = {}
    places: dict[Keys, str] = {}
    problems: list[Problem] = []
    indices: dict[str, int] = {}
    for line, cells in table.rows():
        where = f"{path}:{line}:1"
        if len(cells) != len(table.header):
            problems.append(Problem(where, "", "the row has not as many cells as the header"))
            continue
        row = dict(zip(table.header, cells, strict=True))
        name = row["configuration"].strip()
        numbers = {key: _number(where, key, row[key], problems) for key in (*drives, *_POINT[1:])}
        problems += [
            Problem(where, key, "a drive length is missing") for key in drives if not row[key].strip()
        ]
        values = [numbers[key] for key in drives]
        entry = found.setdefault(name, {"name": name, "drives_mm": values, "points_mm": {}})
        index, point = indices.setdefault(name, len(indices)), row["point"].strip()
        places.setdefault(("configurations", index), where)
        if values != entry["drives_mm"]:
            problems.append(Problem(where, "", f"configuration {name!r} had other drive lengths before"))
        if point in entry["points_mm"]:
            problems.append(Problem(where, "point", f"{point!r} was measured before in {name!r}"))
        entry["points_mm"][point] = [numbers[key] for key in _POINT[1:]]
        places["configurations", index, "points_mm", point] = where
    return found, places, problems


def _number(where: str, key: str, text: str, problems: list[Problem]) -> float | None:
    """Read a cell as a number; return None if it is empty, or, with a problem, if it is none."""
    if not text.strip():
        return None
    value = number_in(text)
    if math.isfinite(value):
        return value
    problems.append(Problem(where, key, f"must be a finite number or empty, not {text.strip()!r}"))
    return None
