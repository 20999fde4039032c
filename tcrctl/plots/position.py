"""End position over time, wanted and actual; Fig. 9 (b) and Fig. 16 of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style


def draw(histories: Sequence[History]) -> Figure:
    """Draw x, y, z [mm] of every run, one below the other."""
    figure, panels = style.time_panels(3)
    actual = [1e3 * history.position for history in histories]
    style.compare(panels, histories, actual, [1e3 * history.wanted_position for history in histories])
    for panel, axis in zip(panels, "xyz", strict=True):
        panel.set_ylabel(f"{axis} [mm]")
    style.span(panels, histories)
    style.legend(figure, panels)
    return figure
