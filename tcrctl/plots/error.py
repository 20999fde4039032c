"""Tracking error over time; Fig. 9 (d) and Fig. 10 (b) of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import numbers
from tcrctl.experiment.spread import spread
from tcrctl.plots import style
from tcrctl.plots.legends import panel_legend
from tcrctl.signals import Array

#: Runs whose largest errors differ by more than this factor are drawn on a logarithmic axis.
APART = 10.0


def draw(histories: Sequence[History]) -> Figure:
    """Draw the position error [mm] and, where an orientation was wanted, the orientation error [deg].

    A single run also shows the components of its position error.
    """
    single = len(histories) == 1
    oriented = any(history.tracks_orientation for history in histories)
    figure, panels = style.time_panels(1 + single + oriented, height_in=1.7)
    for i, history in enumerate(histories):
        name = "" if single else f"{history.label}: "
        _draw(panels[0], i, history, 1e3 * history.position_error, name, "mm")
        if history.tracks_orientation:
            _draw(panels[-1], i, history, np.degrees(history.orientation_error), name, "deg")
    panels[0].set_ylabel("position error [mm]")
    if single:
        _components(panels[1], histories[0])
    if oriented:
        panels[-1].set_ylabel("orientation error [deg]")
    errors = [panels[0], panels[-1]] if oriented else [panels[0]]
    for panel in errors:
        _scale(panel)
    for panel in panels:
        panel_legend(panel, columns=3 if single else 1)
    style.span(panels, histories)
    return figure


def _draw(panel: Axes, index: int, history: History, error: Array, name: str, unit: str) -> None:
    said = numbers(spread(error, "max", "rms"), unit)
    panel.plot(history.t, error, **style.line(index), label=f"{name}{said}")


def _scale(panel: Axes) -> None:
    """Scale from zero to the largest error; logarithmic if one run's would flatten another's."""
    largest = [float(np.nanmax(line.get_ydata())) for line in panel.lines]
    if max(largest) > APART * min(largest) > 0.0:
        panel.set(yscale="log", ylim=(1e-2 * min(largest), 2.0 * max(largest)))
    else:
        panel.set_ylim(bottom=0.0)


def _components(panel: Axes, history: History) -> None:
    parts = 1e3 * (history.position - history.wanted_position)
    for i, axis in enumerate("xyz"):
        panel.plot(history.t, parts[:, i], **style.line(i), label=axis)
    panel.set_ylabel("actual − wanted [mm]")
