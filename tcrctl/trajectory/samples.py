"""Samples of an end pose over time, read from a table and held against common mistakes.

Columns: time; x, y, z; and nx, ny, nz (a unit normal) or qw, qx, qy, qz, in any order. Names may be written in
several ways (``t``, ``time``; ``x``, ``px``, ``pos_x``), units stand behind them: ``t_ms``, ``x_mm``, ``time [s]``.
Other columns are left out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from tcrctl.config.budget import MAX_PROBLEMS
from tcrctl.errors import Problem, SpecError
from tcrctl.signals import Array

#: Units of time and length, in SI.
UNITS: Final[Mapping[str, float]] = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
}
TIMES: Final = ("s", "ms", "us")
NAMES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("t", "time", "timestamp"), "t"),
    **{f"{prefix}{axis}": axis for axis in "xyz" for prefix in ("", "p", "pos_", "position_")},
    **{f"{prefix}{axis}": f"n{axis}" for axis in "xyz" for prefix in ("n", "n_", "normal_")},
    **{f"{prefix}{axis}": f"q{axis}" for axis in "wxyz" for prefix in ("q", "q_", "quaternion_")},
}
POSITION: Final = ("x", "y", "z")
NORMAL: Final = ("nx", "ny", "nz")
QUATERNION: Final = ("qw", "qx", "qy", "qz")
FEWEST: Final = 4
#: Farther apart than this nobody samples [s], nor nearer; farther away no robot reaches [m].
SLOWEST, FASTEST, FARTHEST = 5.0, 1e-4, 10.0
#: How far the length of a normal or quaternion may be from 1.
UNIT: Final = 1e-2


@dataclass(frozen=True, slots=True)
class Samples:
    """End poses over time.

    Attributes:
        t: Times, beginning at 0, increasing (n,) [s].
        position: End positions (n, 3) [m].
        normal: Unit end normals (n, 3), or None.
    """

    t: Array
    position: Array
    normal: Array | None


@dataclass(frozen=True, slots=True)
class Columns:
    """A table as it stands in its file.

    Attributes:
        place: Name of the file.
        values: Columns (n,) by name as it is written.
        lines: Line of every row; empty if the file has no lines, then rows are counted from 1.
    """

    place: str
    values: Mapping[str, Array]
    lines: Sequence[int] = ()

    def problem(self, row: int, column: str, message: str) -> Problem:
        """Return what is wrong with a row, from 0."""
        where = f"{self.place}:{self.lines[row]}:1" if self.lines else f"{self.place}: row {row + 1}"
        return Problem(where, column, message)

    def header(self, message: str) -> SpecError:
        """Return what is wrong with the columns."""
        return SpecError([Problem(f"{self.place}:1:1" if self.lines else self.place, "", message)])


def samples_of(table: Columns, largest_gap: float, speed_limit: float) -> Samples:
    """Return the samples of a table.

    Args:
        table: What was read.
        largest_gap: Longest time between two samples, in medians.
        speed_limit: Largest speed between two samples [m/s].

    Raises:
        SpecError: If columns are missing, times do not increase, or there are gaps and jumps; all are listed.
    """
    found = _in_si(table)
    t = found["t"][1]
    if t.size < FEWEST:
        raise table.header(f"has {t.size} rows; a path needs at least {FEWEST}")
    position = np.stack([found[axis][1] for axis in POSITION], axis=1)
    _refuse(_not_finite(table, found))
    _refuse(_times(table, found["t"][0], t, largest_gap))
    if np.abs(position).max() > FARTHEST:
        row = int(np.argmax(np.abs(position).max(axis=1)))
        hint = "is that in mm? Then name the columns x_mm, y_mm, z_mm"
        _refuse([table.problem(row, "", f"is {np.abs(position[row]).max():g} m away; {hint}")])
    _refuse(_jumps(table, t, position, speed_limit))
    return Samples(t - t[0], position, _normal(table, found))


def _refuse(problems: list[Problem]) -> None:
    if problems:
        raise SpecError(problems[:MAX_PROBLEMS])


def _in_si(table: Columns) -> dict[str, tuple[str, Array]]:
    """Return name in the file and values in SI of every column that is known, by its one name."""
    found: dict[str, tuple[str, Array]] = {}
    for written, values in table.values.items():
        name, unit = _split(written)
        if name is None:
            continue
        if name in found:
            raise table.header(f"columns {found[name][0]!r} and {written!r} are both {name}")
        found[name] = (written, values * _factor(table, name, written, unit))
    wanted = ("t", *POSITION)
    missing = [name for name in wanted if name not in found]
    for group in (NORMAL, QUATERNION):
        if any(name in found for name in group):
            missing += [name for name in group if name not in found]
    if missing:
        has = ", ".join(table.values) or "none"
        raise table.header(f"columns that are missing: {', '.join(missing)}; the table has {has}")
    return found


def _split(written: str) -> tuple[str | None, str]:
    """Return the one name and the unit of a column as it is written; None if it is not known."""
    match = re.fullmatch(r"\s*(.+?)\s*[\[(]\s*(\w+)\s*[\])]\s*", written)
    name, unit = (match[1], match[2]) if match else (written.strip(), "")
    if not match and name.lower() not in NAMES and "_" in name:
        name, _, unit = name.rpartition("_")
    return NAMES.get(name.lower()), unit


def _factor(table: Columns, name: str, written: str, unit: str) -> float:
    if name in (*NORMAL, *QUATERNION):
        if unit not in ("", "1"):
            raise table.header(f"column {written!r}: has no unit, not {unit}")
        return 1.0
    allowed = TIMES if name == "t" else ("m", "cm", "mm", "um")
    if unit not in allowed:
        what = (
            f"has no unit: write {name}_{allowed[0]} or {name}_{allowed[1]}" if not unit else f"unit {unit}"
        )
        raise table.header(f"column {written!r}: {what}; allowed: {', '.join(allowed)}")
    return UNITS[unit]


def _not_finite(table: Columns, found: Mapping[str, tuple[str, Array]]) -> list[Problem]:
    return [
        table.problem(int(row), written, "must be a finite number")
        for written, values in found.values()
        for row in np.flatnonzero(~np.isfinite(values))[:MAX_PROBLEMS]
    ]


def _times(table: Columns, name: str, t: Array, largest_gap: float) -> list[Problem]:
    dt = np.diff(t)
    wrong = [
        table.problem(
            int(i) + 1, name, "the same time as in the row before" if dt[i] == 0.0 else "time goes backwards"
        )
        for i in np.flatnonzero(dt <= 0.0)
    ]
    if wrong:
        return wrong
    usual = float(np.median(dt))
    if usual > SLOWEST:
        return [
            table.problem(1, name, f"the samples are {usual:g} s apart; is the time in ms? Then name it t_ms")
        ]
    if usual < FASTEST:
        return [
            table.problem(1, name, f"the samples are {usual:g} s apart; is the time in s? Then name it t_s")
        ]
    return [
        table.problem(int(i) + 1, name, f"a gap of {dt[i]:g} s, where samples are usually {usual:g} s apart")
        for i in np.flatnonzero(dt > largest_gap * usual)
    ]


def _jumps(table: Columns, t: Array, position: Array, speed_limit: float) -> list[Problem]:
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    speed = step / np.diff(t)
    return [
        table.problem(
            int(i) + 1,
            "",
            f"jumps by {1e3 * step[i]:.4g} mm, at {1e3 * speed[i]:.4g} mm/s; limit {1e3 * speed_limit:g} mm/s",
        )
        for i in np.flatnonzero(speed > speed_limit)
    ]


def _normal(table: Columns, found: Mapping[str, tuple[str, Array]]) -> Array | None:
    """Return unit normals: given, or the z axis that a quaternion turns to (n, 3)."""
    names = next((group for group in (NORMAL, QUATERNION) if group[0] in found), None)
    if names is None:
        return None
    given = np.stack([found[name][1] for name in names], axis=1)
    size = np.linalg.norm(given, axis=1)
    _refuse(
        [
            table.problem(int(i), found[names[0]][0], f"its length must be 1, not {size[i]:.4g}")
            for i in np.flatnonzero(np.abs(size - 1.0) > UNIT)
        ]
    )
    given /= size[:, None]
    if names == NORMAL:
        return given
    w, x, y, z = given.T
    axis: Array = np.stack(
        (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)), axis=1
    )
    return axis
