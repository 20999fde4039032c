"""One quantity of several runs over time, with its numbers in the legend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import numbers
from tcrctl.experiment.spread import spread
from tcrctl.plots import style
from tcrctl.plots.legends import panel_legend
from tcrctl.signals import Array


def draw_values(panel: Axes, histories: Sequence[History], values: Sequence[Array], unit: str) -> None:
    """Draw a line for every run; steps without a value are left out.

    Args:
        panel: Where.
        histories: The runs.
        values: Of every run (n,), in ``unit``.
        unit: Unit.
    """
    for i, (history, found) in enumerate(zip(histories, values, strict=True)):
        known = np.isfinite(found)
        name = "" if len(histories) == 1 else f"{history.label}: "
        said = numbers(spread(found[known], "p50", "p99", "max"), unit) if known.any() else "unknown"
        panel.plot(history.t[known], found[known], **style.line(i), label=f"{name}{said}")
    panel.set_ylim(bottom=0.0)
    style.span([panel], histories)
    panel_legend(panel)
