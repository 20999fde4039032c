"""Cable tensions over time, with the controller's floor and ceiling and the robot's limit."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.plots.cables import draw_cables


def draw(histories: Sequence[History]) -> Figure:
    """Draw the cable tensions [N] of the simulated plant, or as estimated on a rig."""
    source = "" if all(history.simulated for history in histories) else ", estimated"
    figure, panels, shown = draw_cables(histories, lambda history: history.tension, f"tension{source} [N]")
    limits = histories[0].limits
    for panel, values in zip(panels, shown, strict=True):
        panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]))
        for name, at in (("floor", limits.floor), ("ceiling", limits.ceiling), ("limit", limits.tension)):
            style.limit(panel, values, [at], name, "N")
    return figure
