"""The numbers of a page, for its scripts: curves, paths, shapes, task."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.history import History
from tcrctl.analysis.pen import pen_down
from tcrctl.analysis.plane import plane_of
from tcrctl.analysis.references import shared
from tcrctl.analysis.structure import read_structure
from tcrctl.analysis.task_drawing import read_drawing
from tcrctl.experiment.judgement import FINISHED
from tcrctl.log.drawing import Drawing
from tcrctl.report.charts import charts
from tcrctl.report.packing import bundled_times, every, packed, raw
from tcrctl.robot.module import NODES, module_count
from tcrctl.signals import Array

FRAME_RATE_HZ: Final = 20.0
"""Shapes per second; the page draws straight lines between them."""
MOST_FRAMES: Final = 3000
"""Shapes in all."""
_PATH_POINTS: Final = 1500

Result = Mapping[str, Any]


def payload(histories: Sequence[History], results: Sequence[Result]) -> dict[str, Any]:
    """Return what the scripts of the page need; only text, numbers, lists and dicts.

    Args:
        histories: One run, or several to compare.
        results: Their objects of ``run --json``, or parts of them.
    """
    drawings = [read_drawing(history.log) for history in histories]
    plane = plane_of(histories, *(drawing.corners for drawing in drawings))
    return {
        "begin": min(float(history.t[0]) for history in histories),
        "end": max(float(history.t[-1]) for history in histories),
        "open": _opening(histories, results),
        "plane": {
            "right": plane.right.tolist(),
            "up": plane.up.tolist(),
            "name": plane.name,
            "labels": plane.labels,
        },
        "shared_reference": shared(histories, [history.wanted_position for history in histories]),
        "charts": list(charts(histories)),
        "runs": [
            _run(history, drawing, result)
            for history, drawing, result in zip(histories, drawings, results, strict=True)
        ],
    }


def _opening(histories: Sequence[History], results: Sequence[Result]) -> float:
    """Return the time at which the page opens: the first stop, what the first task ended with, or the end."""
    runs = zip(histories, results, strict=True)
    stops = [float(history.t[-1]) for history, result in runs if result.get("status") not in FINISHED]
    if stops:
        return min(stops)
    first = histories[0]
    told = [e.t for e in first.log.events() if e.kind == "task" and first.t[0] <= e.t <= first.t[-1]]
    return float(max(told, default=first.t[-1]))


def _run(history: History, drawing: Drawing, result: Result) -> dict[str, Any]:
    path = every(len(history.t), _PATH_POINTS)
    normal = packed(history.wanted_normal[path]) if history.tracks_orientation else None
    return {
        "label": history.label,
        "t": packed(bundled_times(history.t)),
        "path": {
            "t": packed(history.t[path]),
            "actual": packed(history.position[path]),
            "wanted": packed(history.wanted_position[path]),
            "wanted_normal": normal,
            "drawn": raw(pen_down(history)[path].astype(np.uint8)),
        },
        "events": [
            {"t": e.t, "level": e.level, "said": e.message}
            for e in history.log.events()
            if math.isfinite(e.t)
        ],
        "robot": _robot(history),
        "task": _task(drawing, result),
    }


def _task(drawing: Drawing, result: Result) -> dict[str, Any]:
    sight = drawing.sight
    seen = _first_seen(result.get("task"))
    return {
        "outlines": [
            {"kind": outline.kind, "label": outline.label, "points": packed(outline.points)}
            for outline in drawing.outlines
        ],
        "balls": [
            {"name": b.name, "centre": b.centre.tolist(), "radius": b.radius, "seen": seen.get(b.name)}
            for b in drawing.balls
        ],
        "passages": [
            {
                "entry": p.entry.tolist(),
                "axis": p.axis.tolist(),
                "length": p.length,
                "radius": p.radius,
                "screen": p.screen,
            }
            for p in drawing.passages
        ],
        "sight": None
        if sight is None
        else {"ahead": sight.ahead, "half_angle": sight.half_angle, "reach": sight.reach},
    }


def _first_seen(task: Any) -> dict[str, float]:
    """Return when each object was first seen [s], by name; others may have written the log."""
    items = task.get("objects") if isinstance(task, Mapping) else None
    found = {}
    for item in items if isinstance(items, list) else ():
        at = item.get("first_seen_s") if isinstance(item, Mapping) else None
        if isinstance(at, int | float) and math.isfinite(at):
            found[str(item.get("name"))] = float(at)
    return found


def _robot(history: History) -> dict[str, Any] | None:
    """Return the shapes and what joins their nodes; None if the log has no shapes."""
    if not len(history.shape):
        return None
    frames = _frames(history)
    nodes = history.shape[frames]
    middle, scale = _grid(nodes)
    structure = read_structure(history.log, nodes.shape[1])
    cables = () if structure is None else structure.cables
    return {
        "t": packed(history.t[history.shape_step[frames]]),
        "count": nodes.shape[1],
        "per_module": NODES,
        "nodes": raw(np.round((nodes - middle) / scale).astype("<i2")),
        "middle": middle.tolist(),
        "scale": scale,
        "tip": module_count(nodes.shape[1]) if structure is None else structure.tip_ring,
        "springs": [] if structure is None else structure.springs.tolist(),
        "cables": [
            {"name": c.name, "nodes": c.nodes.tolist(), "weights": np.round(c.weights, 6).tolist()}
            for c in cables
        ],
    }


def _frames(history: History) -> NDArray[np.int64]:
    """Return the rows of ``history.shape`` that are shown."""
    t = history.t[history.shape_step]
    wanted = int(FRAME_RATE_HZ * (t[-1] - t[0])) + 1
    return every(len(t), min(MOST_FRAMES, max(wanted, 2)))


def _grid(nodes: Array) -> tuple[Array, float]:
    """Return the middle and step of a grid of 16-bit integers that holds all nodes."""
    low, high = nodes.min(axis=(0, 1)), nodes.max(axis=(0, 1))
    return (low + high) / 2.0, max(float(np.max(high - low)), 1e-6) / 65530.0
