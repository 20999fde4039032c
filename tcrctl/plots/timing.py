"""Time that a control step takes: over the run, and how often."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import numbers
from tcrctl.experiment.spread import spread
from tcrctl.plots import style
from tcrctl.plots.legends import panel_legend
from tcrctl.signals import Array

_BINS: Final = 60


def draw(histories: Sequence[History]) -> Figure:
    """Draw the time of estimator and controller [ms], its distribution, and the lateness of paced runs."""
    paced = [history for history in histories if np.any(history.lateness > 0.0)]
    figure, rows = _panels(1 + bool(paced))
    compute = [1e3 * history.compute for history in histories]
    _row(rows[0], histories, compute, "control time [ms]")
    period = 1e3 * float(np.median(histories[0].period))
    rows[0][1].set_title(f"period {period:g} ms", loc="right", fontsize="small")
    if paced:
        _row(rows[1], paced, [1e3 * history.lateness for history in paced], "lateness [ms]")
    rows[-1][0].set_xlabel("t [s]")
    rows[-1][1].set_xlabel("steps")
    return figure


def _panels(count: int) -> tuple[Figure, Any]:
    """Make a figure with pairs of panels (count, 2), beside each other where there is room."""
    height = 1.0 + 1.9 * count
    if style.is_narrow():
        figure = style.new_figure(1.8 * height)
        return figure, figure.subplots(2 * count, 1).reshape(count, 2)
    figure = style.new_figure(height)
    return figure, figure.subplots(count, 2, width_ratios=(2.2, 1.0), squeeze=False)


def _row(row: Sequence[Axes], histories: Sequence[History], values: Sequence[Array], name: str) -> None:
    over_time, often = row
    top = max(float(np.nanmax(v)) for v in values)
    edges = np.linspace(0.0, top or 1.0, _BINS + 1).tolist()
    for i, (history, found) in enumerate(zip(histories, values, strict=True)):
        prefix = "" if len(histories) == 1 else f"{history.label}: "
        label = f"{prefix}{numbers(spread(found, 'p50', 'p99', 'max'), 'ms')}"
        style_i = style.line(i)
        over_time.plot(history.t, found, lw=0.7, color=style_i["color"], label=label)
        often.hist(
            found,
            edges,
            orientation="horizontal",
            histtype="step",
            color=style_i["color"],
            ls=style_i["linestyle"],
        )
    over_time.set(ylabel=name, ylim=(0.0, 1.08 * (top or 1.0)))
    style.span([over_time], histories)
    panel_legend(over_time)
    often.set(ylim=over_time.get_ylim(), xscale="log")
