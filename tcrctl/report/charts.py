"""The curves of a page. One run: everything about it; several: one curve per run where that says something.

A chart is a dict for the scripts: name, unit, lines, limits, spans in which it says nothing, and what it shows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.history import History
from tcrctl.analysis.references import shared
from tcrctl.report.packing import bundled, bundled_marks, packed, raw
from tcrctl.signals import Array

Chart = dict[str, Any]
Limit = dict[str, Any]
Quantity = Callable[[History], Array]

WANTED: Final = "wanted"


def charts(histories: Sequence[History]) -> Iterator[Chart]:
    """Yield all charts of one run, or of several to compare."""
    yield _each("position error", "mm", histories, lambda h: 1e3 * h.position_error, from_zero=True)
    if any(h.tracks_orientation for h in histories):
        tracking = [i for i, h in enumerate(histories) if h.tracks_orientation]
        yield _each(
            "orientation error",
            "deg",
            histories,
            lambda h: np.degrees(h.orientation_error),
            tracking,
            from_zero=True,
        )
    yield from _pose(histories)
    for i, history in enumerate(histories):
        yield from _cables(i, history, f", {history.label}" if len(histories) > 1 else "")
    yield from _inside(histories)


def _pose(histories: Sequence[History]) -> Iterator[Chart]:
    for axis, name in enumerate("xyz"):
        yield _pair(name, "mm", histories, [1e3 * h.position[:, axis] for h in histories],
                    [1e3 * h.wanted_position[:, axis] for h in histories])  # fmt: skip
    if not any(h.tracks_orientation for h in histories):
        return
    for axis, name in enumerate(("θx", "θy")):
        chart = _pair(name, "deg", histories, [np.degrees(h.angles[:, axis]) for h in histories],
                      [np.degrees(h.wanted_angles[:, axis]) for h in histories])  # fmt: skip
        chart["spans"] = [] if axis else _spans(histories)
        yield chart


def _cables(run: int, history: History, whose: str) -> Iterator[Chart]:
    limits = history.limits
    stroke = [_limit("stroke", 1e3 * end) for end in limits.stroke or ()]
    yield _by_cable(run, history, f"drive{whose}", "mm", 1e3 * history.drive, stroke)
    bound = [] if limits.speed is None else [_limit("limit", s * 1e3 * limits.speed) for s in (-1.0, 1.0)]
    speeds = _by_cable(run, history, f"drive speed{whose}", "mm/s", 1e3 * history.speed, bound)
    for line, mark in zip(speeds["lines"], history.saturated.T, strict=True):
        line["marks"] = raw(bundled_marks(mark).astype(np.uint8))
    yield speeds
    known = [("floor", limits.floor), ("ceiling", limits.ceiling), ("limit", limits.tension)]
    source = "" if history.simulated else " (estimated)"
    tensions = _by_cable(run, history, f"tension{source}{whose}", "N", history.tension,
                         [_limit(name, at) for name, at in known if at is not None])  # fmt: skip
    yield {**tensions, "shows": "tension", "run": run}


def _inside(histories: Sequence[History]) -> Iterator[Chart]:
    """Yield what tells how well the run ran: innovation, latencies, lateness, computing time."""
    if any(np.isfinite(h.innovation).any() for h in histories):
        name = "innovation: markers from model, rms"
        yield _each(name, "mm", histories, lambda h: 1e3 * _filled(h, h.innovation), from_zero=True)
    yield _each("age of the camera picture", "ms", histories, lambda h: 1e3 * h.age, from_zero=True)
    if any(np.isfinite(h.answer).any() for h in histories):
        yield _each("latency, camera to drive", "ms", histories, lambda h: 1e3 * h.answer, from_zero=True)
    if any(np.any(h.lateness > 0.0) for h in histories):
        yield _each("lateness of steps", "ms", histories, lambda h: 1e3 * h.lateness, from_zero=True)
    chart = _each("control time", "ms", histories, lambda h: 1e3 * h.compute, from_zero=True)
    chart["limits"] = [_limit("period", 1e3 * float(np.median(histories[0].period)))]
    yield chart


def _filled(history: History, values: Array) -> Array:
    """Draw straight lines between the steps that have a value, where others lack it."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    return np.interp(history.t, history.t[known], values[known])


def _each(
    name: str,
    unit: str,
    histories: Sequence[History],
    quantity: Quantity,
    runs: Sequence[int] | None = None,
    *,
    from_zero: bool = False,
) -> Chart:
    """Return a chart with one line per run."""
    single = len(histories) == 1
    chosen = range(len(histories)) if runs is None else runs
    lines = [_line("" if single else histories[i].label, i, i, quantity(histories[i])) for i in chosen]
    return _chart(name, unit, lines, from_zero=from_zero)


def _pair(
    name: str, unit: str, histories: Sequence[History], actual: Sequence[Array], wanted: Sequence[Array]
) -> Chart:
    """Return a chart with what was reached and what was wanted; that once if all runs wanted the same."""
    single = len(histories) == 1
    lines = [_line("actual" if single else h.label, i, i, actual[i]) for i, h in enumerate(histories)]
    whole = shared(histories, wanted)
    for i, values in enumerate(wanted) if whole is None else [(whole, wanted[whole])]:
        if np.isfinite(values).any():
            label = WANTED if whole is not None else f"{WANTED}, {histories[i].label}"
            lines.append(_line(label, i, i, values, wanted=True))
    return _chart(name, unit, lines)


def _by_cable(run: int, history: History, name: str, unit: str, values: Array, limits: list[Limit]) -> Chart:
    lines = [_line(cable, run, c, values[:, c]) for c, cable in enumerate(history.cables)]
    return {**_chart(name, unit, lines), "limits": limits}


def _chart(name: str, unit: str, lines: list[dict[str, Any]], *, from_zero: bool = False) -> Chart:
    return {"name": name, "unit": unit, "lines": lines, "limits": [], "spans": [], "from_zero": from_zero}


def _line(name: str, run: int, look: int, values: Array, *, wanted: bool = False) -> dict[str, Any]:
    return {"name": name, "run": run, "look": look, "wanted": wanted, "values": packed(bundled(values)),
            "marks": None}  # fmt: skip


def _limit(name: str, at: float) -> Limit:
    return {"name": name, "at": at}


def _spans(histories: Sequence[History]) -> list[list[float]]:
    """Return from when to when theta_x says nothing, in any run."""
    return [span for history in histories for span in stretches(history.t, history.singular)]


def stretches(t: Array, flags: NDArray[np.bool_]) -> list[list[float]]:
    """Return the first and the last time of every run of flags [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return [[float(t[first]), float(t[last - 1])] for first, last in edges.reshape(-1, 2)]
