"""What the task was, and the way of the end through it, seen across its plane."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.plots.plan import draw_plan


def draw(histories: Sequence[History]) -> Figure:
    """Draw the path as a drawing [mm] with walls, holes and objects, or pipes and their axes."""
    figure = style.new_figure(4.5)
    panel = figure.subplots()
    draw_plan(panel, histories)
    style.legend(figure, [panel])
    return figure
