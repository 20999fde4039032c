"""Drive lengths over time; Fig. 9 (c), Fig. 11 (c) and Fig. 19 (b) of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.plots.cables import draw_cables


def draw(histories: Sequence[History]) -> Figure:
    """Draw the measured drive lengths [mm], positive taken in, with the stroke's ends where they are near."""
    figure, panels, shown = draw_cables(histories, lambda history: 1e3 * history.drive, "drive [mm]")
    stroke = [1e3 * end for end in histories[0].limits.stroke or ()]
    for panel, values in zip(panels, shown, strict=True):
        style.limit(panel, values, stroke, "stroke", "mm")
    return figure
