"""How far the markers seen are from the model that the estimator has moved there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.plots.over_time import draw_values


def draw(histories: Sequence[History]) -> Figure:
    """Draw the rms distance of the markers from the model [mm], where a step has a full state."""
    figure, panels = style.time_panels(1, height_in=2.6)
    draw_values(panels[0], histories, [1e3 * history.innovation for history in histories], "mm")
    panels[0].set_ylabel("markers from model, rms [mm]")
    if not any(np.isfinite(history.innovation).any() for history in histories):
        panels[0].set_title("no step has the full state", loc="right", fontsize="small")
    return figure
