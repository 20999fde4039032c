"""Drive speeds over time, with their limits, and where they stood at them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import number
from tcrctl.plots import style
from tcrctl.plots.cables import draw_cables


def draw(histories: Sequence[History]) -> Figure:
    """Draw the applied drive speeds [mm/s]; crosses mark saturated inputs."""
    figure, panels, shown = draw_cables(histories, lambda history: 1e3 * history.speed, "drive speed [mm/s]")
    for history in histories:
        _mark(panels, history)
    bound = histories[0].limits.speed
    bounds = () if bound is None else (-1e3 * bound, 1e3 * bound)
    for panel, values in zip(panels, shown, strict=True):
        style.limit(panel, values, bounds, "limit", "mm/s")
    if len(histories) == 1:
        share = 100.0 * float(np.mean(histories[0].saturated.any(axis=1)))
        said = number(share, "% of the steps")
        panels[0].set_title(f"at the speed limit (x): {said}", loc="left", fontsize=7)
    return figure


def _mark(panels: list[Axes], history: History) -> None:
    """Cross every saturated input, in its only panel or in that of its cable."""
    for c, saturated in enumerate(history.saturated.T):
        panel = panels[c if len(panels) > 1 else 0]
        at = 1e3 * history.speed[saturated, c]
        panel.plot(history.t[saturated], at, ls="", marker="x", ms=3.5, mew=0.8, color=style.BLACK)
