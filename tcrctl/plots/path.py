"""Path of the end in space with its orientation; Fig. 11 (b) and Fig. 19 (a) of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.analysis.pen import pen_down
from tcrctl.analysis.references import shared
from tcrctl.plots import style
from tcrctl.plots.space import arrows, equal_scale, name_axes
from tcrctl.signals import Array

_ARROWS: Final = 24


def draw(histories: Sequence[History]) -> Figure:
    """Draw the end's path [mm], wanted and actual; arrows point along the end axis, away from the robot."""
    figure = style.new_figure(5.0)
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    paths = [1e3 * path for history in histories for path in (history.wanted_position, history.position)]
    extent = max(float(np.ptp(path, axis=0).max()) for path in paths)
    turns = any(history.tracks_orientation for history in histories)
    length = max(0.15 * extent, 20.0 if turns else 4.0)
    whole = shared(histories, [history.wanted_position for history in histories])
    for i, history in enumerate(histories):
        name = history.label if len(histories) > 1 else "actual"
        if whole in (None, i):
            wanted = "wanted" if whole is not None else f"wanted, {history.label}"
            _draw_wanted(
                axes, history, length, wanted, style.BLACK if whole is not None else style.line(i)["color"]
            )
        _draw(axes, history, length, style.line(i), name)
    equal_scale(axes, paths, length)
    name_axes(axes)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _draw_wanted(axes: Any, history: History, length: float, name: str, colour: str) -> None:
    wanted = 1e3 * history.wanted_position
    axes.plot(*wanted.T, color=colour, lw=0.9, ls=(0, (2, 2)), label=name, zorder=6)
    if not history.tracks_orientation:
        return
    rows = _spread(1e3 * history.position, history.t)
    rows = rows[np.isfinite(history.wanted_normal[rows]).all(axis=1)]
    look = {"color": colour, "lw": 0.7, "label": f"{name} end axis", "zorder": 2}
    arrows(axes, wanted[rows], -history.wanted_normal[rows], 1.25 * length, **look)


def _draw(axes: Any, history: History, length: float, look: dict[str, Any], name: str) -> None:
    actual, down = 1e3 * history.position, pen_down(history)[:, None]
    rows = _spread(actual, history.t)
    axes.plot(*np.where(down, np.nan, actual).T, color=look["color"], lw=0.4, zorder=4)
    axes.plot(*np.where(down, actual, np.nan).T, **look, label=name, zorder=4)
    label = "end axis" if name == "actual" else None
    arrows(
        axes, actual[rows], -history.normal[rows], length, color=look["color"], lw=1.0, label=label, zorder=5
    )


def _spread(path: Array, t: Array) -> Array:
    """Return steps (n,) at which arrows are drawn: equally far apart on the path, and in time where it rests."""
    moved = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    clock = (t - t[0]) / max(float(t[-1] - t[0]), 1e-9)
    progress = moved / max(float(moved[-1]), 1e-9) + 0.2 * clock
    rows = np.searchsorted(progress, np.linspace(0.0, progress[-1], _ARROWS))
    return np.unique(np.minimum(rows, len(t) - 1))
