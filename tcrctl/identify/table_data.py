"""Static data as a table (CSV): turned into the document that a YAML file of the same content would give."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcrctl.config.budget import MAX_PROBLEMS
from tcrctl.config.keys import Keys
from tcrctl.config.strict_yaml import Document, placed, read
from tcrctl.errors import Problem, SpecError
from tcrctl.visible import visible

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
    try:
        text = read(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SpecError([Problem(f"{path}:1:1", "", f"not UTF-8 text: {error.reason}")]) from None
    _check_characters(path, text.replace("\r", "\n"))
    # A quote that is never closed would take the rest of the file for one cell.
    rows = csv.DictReader(io.StringIO(text, newline=None), skipinitialspace=True, strict=True)
    drives = [f"drive_{name}_mm" for name in cables]
    last = 1
    try:
        _check_header(path, list(rows.fieldnames or ()), ["configuration", *drives, *_POINT])
        lines: list[tuple[int, dict[str, Any]]] = []
        for row in rows:
            last = rows.line_num + 1
            lines.append((rows.line_num, row))
    except csv.Error as error:
        raise SpecError([Problem(f"{path}:{last}:1", "", _table_message(text, last, error))]) from None
    found, places, problems = _collect(path, lines, drives)
    if problems:
        raise SpecError(problems[:MAX_PROBLEMS])
    return placed(str(path), {"configurations": list(found.values())}, places)


def _check_characters(path: Path, text: str) -> None:
    shown = visible(text)
    if shown != text:
        at = next(i for i, (a, b) in enumerate(zip(text, shown, strict=False)) if a != b)
        before = text[:at].splitlines() or [""]
        where = f"{path}:{len(before)}:{len(before[-1]) + 1}"
        raise SpecError([Problem(where, "", f"character U+{ord(text[at]):04X} is not allowed in a table")])


def _table_message(text: str, line: int, error: csv.Error) -> str:
    """Return what is wrong with a table that cannot be read, from the beginning of a line on."""
    begins = "".join(text.splitlines(keepends=True)[line - 1 : line])
    return "a quote that is opened here is not closed" if '"' in begins else f"is no table: {error}"


def _check_header(path: Path, given: list[str], wanted: list[str]) -> None:
    if len(given) == 1 and any(mark in given[0] for mark in ";\t|"):
        mark = next(mark for mark in ";\t|" if mark in given[0])
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
    path: Path, lines: list[tuple[int, dict[str, Any]]], drives: list[str]
) -> tuple[dict[str, Any], dict[Keys, str], list[Problem]]:
    """Gather the rows of every configuration; a configuration's drives must agree in all of its rows."""
    found: dict[str, dict[str, Any]] = {}
    places: dict[Keys, str] = {}
    problems: list[Problem] = []
    indices: dict[str, int] = {}
    for line, row in lines:
        where, name = f"{path}:{line}:1", (row["configuration"] or "").strip()
        if None in row or None in row.values():
            problems.append(Problem(where, "", "the row has not as many cells as the header"))
            continue
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
    try:
        value = math.nan if "_" in text else float(text)  # 5_0 is a number of Python only
    except ValueError:
        value = math.nan
    if math.isfinite(value):
        return value
    problems.append(Problem(where, key, f"must be a finite number or empty, not {text.strip()!r}"))
    return None
