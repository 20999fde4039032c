"""End orientation angles of (45) over time, wanted and actual; Fig. 12 and Fig. 16 of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style


def draw(histories: Sequence[History]) -> Figure:
    """Draw theta_x and theta_y [deg] of every run; runs that leave the orientation free have no wanted one."""
    figure, panels = style.time_panels(2, height_in=1.8)
    actual = [np.degrees(history.angles) for history in histories]
    style.compare(panels, histories, actual, [np.degrees(history.wanted_angles) for history in histories])
    for panel, axis in zip(panels, "xy", strict=True):
        panel.set_ylabel(rf"$\theta_{axis}$ [deg]")
    if not any(history.tracks_orientation for history in histories):
        panels[0].set_title("orientation is free", loc="right", fontsize="small")
    style.span(panels, histories)
    style.legend(figure, panels)
    return figure
