"""The numbers of a page: time series and shapes, thinned out and packed.

Arrays are little-endian and base64: float32 for series, 16-bit integers for shapes (about 0.02 mm each).
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.history import History
from tcrctl.analysis.structure import read_structure
from tcrctl.robot.module import NODES, module_count
from tcrctl.signals import Array

MOST_POINTS: Final = 4000
"""Points per curve; of more, the smallest and the largest of every bundle are kept."""
FRAME_RATE_HZ: Final = 20.0
"""Shapes per second; the page draws straight lines between them."""
MOST_FRAMES: Final = 3000
"""Shapes in all."""
_PATH_POINTS: Final = 1500


def payload(history: History) -> dict[str, Any]:
    """Return what the scripts of the page need; only text, numbers, lists and dicts.

    Args:
        history: The run.
    """
    t = history.t
    path = _every(len(t), _PATH_POINTS)
    return {
        "t": _floats(bundled_times(t)),
        "begin": float(t[0]),
        "end": float(t[-1]),
        "charts": list(_charts(history)),
        "path": {
            "t": _floats(t[path]),
            "actual": _floats(history.position[path]),
            "wanted": _floats(history.wanted_position[path]),
            "wanted_normal": _floats(history.wanted_normal[path]) if history.tracks_orientation else None,
        },
        "robot": _robot(history),
    }


def _charts(history: History) -> Iterator[dict[str, Any]]:
    limits, cables = history.limits, history.cables
    yield _chart("position error", "mm", {"error": 1e3 * history.position_error}, from_zero=True)
    if history.tracks_orientation:
        angle = np.degrees(history.orientation_error)
        yield _chart("orientation error", "deg", {"error": angle}, from_zero=True)
    for i, axis in enumerate("xyz"):
        yield _pair(axis, "mm", 1e3 * history.position[:, i], 1e3 * history.wanted_position[:, i])
    for i, axis in enumerate(("θx", "θy")):
        yield _pair(axis, "deg", np.degrees(history.angles[:, i]), np.degrees(history.wanted_angles[:, i]))
    drive, speed = 1e3 * history.drive, 1e3 * history.speed
    stroke = [1e3 * end for end in limits.stroke or ()]
    yield _chart("drive", "mm", _named(cables, drive), limits=[("stroke", at) for at in stroke])
    bound = [] if limits.speed is None else [-1e3 * limits.speed, 1e3 * limits.speed]
    yield _chart(
        "drive speed",
        "mm/s",
        _named(cables, speed),
        limits=[("limit", at) for at in bound],
        marks=history.saturated,
    )
    known = [("floor", limits.floor), ("ceiling", limits.ceiling), ("limit", limits.tension)]
    yield _chart(
        "tension", "N", _named(cables, history.tension), limits=[(n, at) for n, at in known if at is not None]
    )
    yield _chart("control time", "ms", {"estimator and controller": 1e3 * history.compute}, from_zero=True)


def _named(cables: tuple[str, ...], values: Array) -> dict[str, Array]:
    return dict(zip(cables, values.T, strict=True))


def _pair(name: str, unit: str, actual: Array, wanted: Array) -> dict[str, Any]:
    lines = {"actual": actual, **({"wanted": wanted} if np.isfinite(wanted).any() else {})}
    return _chart(name, unit, lines)


def _chart(
    name: str,
    unit: str,
    lines: dict[str, Array],
    *,
    limits: list[tuple[str, float]] | None = None,
    marks: NDArray[np.bool_] | None = None,
    from_zero: bool = False,
) -> dict[str, Any]:
    return {
        "name": name,
        "unit": unit,
        "lines": [{"name": label, "values": _floats(bundled(values))} for label, values in lines.items()],
        "limits": [{"name": label, "at": at} for label, at in limits or ()],
        "marks": None
        if marks is None
        else [_bytes(bundled_marks(mark).astype(np.uint8)) for mark in marks.T],
        "from_zero": from_zero,
    }


def _robot(history: History) -> dict[str, Any] | None:
    """Return the shapes and what joins their nodes; None if the log has no shapes."""
    if not len(history.shape):
        return None
    frames = _frames(history)
    nodes = history.shape[frames]
    middle, scale = _grid(nodes)
    structure = read_structure(history.log, nodes.shape[1])
    return {
        "t": _floats(history.t[history.shape_step[frames]]),
        "count": nodes.shape[1],
        "per_module": NODES,
        "nodes": _bytes(np.round((nodes - middle) / scale).astype("<i2")),
        "middle": middle.tolist(),
        "scale": scale,
        "tip": module_count(nodes.shape[1]) if structure is None else structure.tip_ring,
        "springs": [] if structure is None else structure.springs.tolist(),
        "cables": []
        if structure is None
        else [
            {
                "name": cable.name,
                "nodes": cable.nodes.tolist(),
                "weights": np.round(cable.weights, 6).tolist(),
            }
            for cable in structure.cables
        ],
    }


def _frames(history: History) -> NDArray[np.int64]:
    """Return the rows of ``history.shape`` that are shown."""
    t = history.t[history.shape_step]
    wanted = int(FRAME_RATE_HZ * (t[-1] - t[0])) + 1
    return _every(len(t), min(MOST_FRAMES, max(wanted, 2)))


def _grid(nodes: Array) -> tuple[Array, float]:
    """Return the middle and step of a grid of 16-bit integers that holds all nodes."""
    low, high = nodes.min(axis=(0, 1)), nodes.max(axis=(0, 1))
    return (low + high) / 2.0, max(float(np.max(high - low)), 1e-6) / 65530.0


def _every(count: int, most: int) -> NDArray[np.int64]:
    """Return at most ``most`` of ``count`` rows, equally far apart, first and last among them."""
    return np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64))


def _bundles(count: int) -> tuple[int, int]:
    """Return the number of bundles and points in each, so that two per bundle are at most ``MOST_POINTS``."""
    size = -(-2 * count // MOST_POINTS)
    return count // size, size


def bundled(values: Array) -> Array:
    """Thin out a curve so that no peak is lost.

    Args:
        values: (n,), may hold NaN.

    Returns:
        ``values`` if they are few; else smallest and largest of every bundle, in the order in which they come. A
        rest smaller than a bundle at the end is left out.
    """
    if len(values) <= MOST_POINTS:
        return values
    count, size = _bundles(len(values))
    rows = values[: count * size].reshape(count, size)
    known = np.where(np.isfinite(rows), rows, 0.0)
    ends = np.sort(np.stack([known.argmin(axis=1), known.argmax(axis=1)], axis=1), axis=1)
    return np.take_along_axis(rows, ends, axis=1).ravel()


def bundled_times(t: Array) -> Array:
    """Return times (k,) of the points that :func:`bundled` keeps: the first and the middle of every bundle."""
    if len(t) <= MOST_POINTS:
        return t
    count, size = _bundles(len(t))
    rows = t[: count * size].reshape(count, size)
    return rows[:, [0, size // 2]].ravel()


def bundled_marks(marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return marks (k,) of the points that :func:`bundled` keeps: set where any point of the bundle is marked."""
    if len(marks) <= MOST_POINTS:
        return marks
    count, size = _bundles(len(marks))
    return np.repeat(marks[: count * size].reshape(count, size).any(axis=1), 2)


def _floats(values: Array) -> str:
    return _bytes(np.ascontiguousarray(values, dtype="<f4"))


def _bytes(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
