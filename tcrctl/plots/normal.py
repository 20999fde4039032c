"""Components of the end normal over time, wanted and actual; Fig. 25 (b) of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style


def draw(histories: Sequence[History]) -> Figure:
    """Draw the three components of the end normal of every run, one below the other."""
    figure, panels = style.time_panels(3)
    actual = [history.normal for history in histories]
    style.compare(panels, histories, actual, [history.wanted_normal for history in histories])
    for panel, axis in zip(panels, "xyz", strict=True):
        panel.set_ylabel(f"$n_{axis}$")
    style.span(panels, histories)
    style.legend(figure, panels)
    return figure
