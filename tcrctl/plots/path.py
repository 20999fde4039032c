"""Path of the end in space with its orientation; Fig. 11 (b) and Fig. 19 (a) of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
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
    for i, history in enumerate(histories):
        _draw(axes, history, length, style.line(i), history.label if len(histories) > 1 else "actual", not i)
    equal_scale(axes, paths, length)
    name_axes(axes)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _draw(
    axes: Any, history: History, length: float, look: dict[str, Any], name: str, with_wanted: bool
) -> None:
    wanted, actual = 1e3 * history.wanted_position, 1e3 * history.position
    rows = _spread(actual, history.t)
    if with_wanted:
        axes.plot(*wanted.T, color=style.BLACK, lw=0.9, ls=(0, (2, 2)), label="wanted", zorder=6)
        if history.tracks_orientation:
            free = ~np.isfinite(history.wanted_normal[rows]).all(axis=1)
            rows_wanted = rows[~free]
            arrows(
                axes,
                wanted[rows_wanted],
                -history.wanted_normal[rows_wanted],
                1.25 * length,
                color=style.BLACK,
                lw=0.7,
                label="wanted end axis",
                zorder=2,
            )
    axes.plot(*actual.T, **look, label=name, zorder=4)
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
