"""The paths of ends as drawings, seen across their plane, with the task that they had."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tcrctl.analysis.history import History
from tcrctl.analysis.pen import pen_down
from tcrctl.analysis.plane import POINT, Plane, plane_of
from tcrctl.analysis.references import shared
from tcrctl.analysis.task_drawing import read_drawing
from tcrctl.log.drawing import Drawing, circle
from tcrctl.plots import style
from tcrctl.signals import Array

Mask: TypeAlias = NDArray[np.bool_]

WANTED: Final = "#bbbbbb"
#: Edges of a task by kind.
_EDGES: Final = {"wall": "#404040", "hole": style.VERMILION, "pipe": "#404040", "screen": style.GREY}


def draw_plan(panel: Axes, histories: Sequence[History]) -> None:
    """Draw what was wanted, thick and light, and what was reached, travel between strokes thin [mm]."""
    drawings = [read_drawing(history.log) for history in histories]
    plane = plane_of(histories, *(drawing.corners for drawing in drawings))
    for drawing in drawings[: 1 if all(_alike(drawings[0], other) for other in drawings) else None]:
        _task(panel, drawing, plane)
    _wanted(panel, histories, plane)
    for i, history in enumerate(histories):
        name = "end of the robot" if len(histories) == 1 else history.label
        _path(panel, plane.flat(1e3 * history.position), pen_down(history), style.line(i), name)
    panel.set_title(plane.name, loc="left")
    panel.set(xlabel=f"{plane.labels[0]} [mm]", ylabel=f"{plane.labels[1]} [mm]")
    panel.set_aspect("equal", adjustable="datalim")


def _wanted(panel: Axes, histories: Sequence[History], plane: Plane) -> None:
    """Draw the reference under the paths, or that of every run if they wanted different things."""
    whole = shared(histories, [history.wanted_position for history in histories])
    for i in range(len(histories)) if whole is None else (whole,):
        wanted, down = histories[i].wanted_position, pen_down(histories[i])
        colour = WANTED if whole is not None else style.line(i)["color"]
        name = "wanted" if whole is not None else f"wanted, {histories[i].label}"
        flat = plane.flat(1e3 * wanted)
        if np.nanmax(np.ptp(wanted, axis=0)) <= POINT:
            panel.plot(*flat[:1].T, color=colour, ls="", marker="P", ms=9, label=name)
            continue
        alpha = 1.0 if whole is not None else 0.3
        panel.plot(*_masked(flat, ~down).T, color=colour, lw=0.8, alpha=alpha)
        panel.plot(*_masked(flat, down).T, color=colour, lw=4.0, alpha=alpha, label=name)


def _path(panel: Axes, flat: Array, down: Mask, look: dict[str, Any], name: str) -> None:
    panel.plot(*_masked(flat, ~down).T, color=look["color"], lw=0.4)
    panel.plot(*_masked(flat, down).T, **look, label=name)


def _masked(points: Array, shown: Mask) -> Array:
    """Return points (n, 2) with gaps where nothing is shown."""
    return np.asarray(np.where(shown[:, None], points, np.nan))


def _task(panel: Axes, drawing: Drawing, plane: Plane) -> None:
    named: set[str] = set()
    for outline in drawing.outlines:
        flat = plane.flat(1e3 * np.concatenate((outline.points, outline.points[:1])))
        label = None if outline.kind in named else outline.kind
        named.add(outline.kind)
        panel.plot(*flat.T, color=_EDGES[outline.kind], lw=0.7, label=label)
        if outline.label:
            panel.annotate(outline.label, flat.mean(axis=0), fontsize="x-small", ha="center", va="bottom")
    across = np.cross(plane.right, plane.up)
    for ball in drawing.balls:
        rim = plane.flat(1e3 * circle(ball.centre, across, ball.radius))
        panel.fill(*rim.T, color=style.ORANGE, alpha=0.6, lw=0.0)
        panel.annotate(ball.name, rim.mean(axis=0), fontsize="x-small", ha="center", va="center")
    for passage in drawing.passages:
        ends = np.stack((passage.entry, passage.entry + (passage.length + passage.screen) * passage.axis))
        panel.plot(*plane.flat(1e3 * ends).T, color=style.ORANGE, lw=0.7, ls=(0, (4, 2)))


def _alike(one: Drawing, other: Drawing) -> bool:
    corners = one.corners, other.corners
    return corners[0].shape == corners[1].shape and np.allclose(*corners)
