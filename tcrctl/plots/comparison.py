"""The numbers of several runs beside each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import number
from tcrctl.plots import style
from tcrctl.plots.legends import broken
from tcrctl.signals import Array

#: Width of a panel by its longest bar: behind that stands the number.
_ROOM: Final = 1.5


def draw(histories: Sequence[History]) -> Figure:
    """Draw errors, tension and control time of every run: rms or median as a dot, the largest as a bar's end."""
    measures: list[tuple[str, list[Array], Callable[[Array], float]]] = [
        ("position error [mm]", [1e3 * history.position_error for history in histories], _rms),
        ("largest tension [N]", [history.tension.max(axis=1) for history in histories], _median),
        ("control time [ms]", [1e3 * history.compute for history in histories], _median),
    ]
    if any(history.tracks_orientation for history in histories):
        angles = [np.degrees(history.orientation_error) for history in histories]
        measures.insert(1, ("orientation error [deg]", angles, _rms))
    figure, panels = _panels(len(measures), len(histories))
    for panel, (name, values, middle) in zip(panels, measures, strict=True):
        _draw(panel, values, middle)
        panel.set_xlabel(f"{name}\ndot: {'rms' if middle is _rms else 'median'}, end: max")
    names = [history.label for history in histories]
    panels[0].set_yticks(range(len(names)), [broken(name) if style.is_narrow() else name for name in names])
    panels[0].set_ylim(len(histories) - 0.4, -0.6)
    return figure


def _panels(count: int, runs: int) -> tuple[Figure, list[Axes]]:
    """Make a figure with panels beside each other, or below each other where there is no room."""
    height = 0.9 + 0.35 * runs
    if style.is_narrow():
        figure = style.new_figure(count * height)
        return figure, figure.subplots(count, 1, sharey=True, squeeze=False)[:, 0].tolist()
    figure = style.new_figure(height)
    return figure, figure.subplots(1, count, sharey=True, squeeze=False)[0].tolist()


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def _median(values: Array) -> float:
    return float(np.nanmedian(values))


def _draw(panel: Axes, values: Sequence[Array], middle: Callable[[Array], float]) -> None:
    for i, found in enumerate(values):
        if not np.isfinite(found).any():
            continue
        most, usual, colour = float(np.nanmax(found)), float(middle(found)), style.line(i)["color"]
        panel.plot([0.0, most], [i, i], color=colour, lw=3.0, alpha=0.5, solid_capstyle="butt")
        panel.plot([usual], [i], color=colour, marker="o", ms=4, ls="")
        beside = {"xytext": (3, 0), "textcoords": "offset points", "va": "center", "fontsize": "x-small"}
        panel.annotate(number(most), (most, i), **beside)  # type: ignore[arg-type]
    most = max((float(np.nanmax(found)) for found in values if np.isfinite(found).any()), default=1.0)
    panel.set_xlim(0.0, _ROOM * (most or 1.0))
