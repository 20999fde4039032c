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
            _beside(panel, outline.label, flat, -1)
    _balls(panel, drawing, plane)
    for i, passage in enumerate(drawing.passages):
        ends = np.stack((passage.entry, passage.entry + (passage.length + passage.screen) * passage.axis))
        look: dict[str, Any] = {"color": style.ORANGE, "lw": 0.7, "ls": (0, (4, 2))}
        panel.plot(*plane.flat(1e3 * ends).T, **look, label=None if i else "axis")


def _balls(panel: Axes, drawing: Drawing, plane: Plane) -> None:
    """Draw objects; names of those on the left stand left of them, so that neighbours do not cover each other's."""
    across = np.cross(plane.right, plane.up)
    rims = [plane.flat(1e3 * circle(ball.centre, across, ball.radius)) for ball in drawing.balls]
    middle = np.mean([rim[:, 0].mean() for rim in rims]) if rims else 0.0
    for i, (ball, rim) in enumerate(zip(drawing.balls, rims, strict=True)):
        panel.fill(*rim.T, color=style.ORANGE, alpha=0.6, lw=0.0, label=None if i else "object")
        _beside(panel, ball.name, rim, 1 if rim[:, 0].mean() >= middle else -1)


def _beside(panel: Axes, text: str, outline: Array, side: int) -> None:
    """Write a name to the left (-1) or right (1) of an outline (n, 2) [mm]."""
    edge = outline[:, 0].max() if side > 0 else outline[:, 0].min()
    look: dict[str, Any] = {"fontsize": "x-small", "ha": "left" if side > 0 else "right", "va": "center"}
    panel.annotate(
        text, (edge, outline[:, 1].mean()), xytext=(3 * side, 0), textcoords="offset points", **look
    )


def _alike(one: Drawing, other: Drawing) -> bool:
    corners = one.corners, other.corners
    return corners[0].shape == corners[1].shape and np.allclose(*corners)
