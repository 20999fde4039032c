"""How old what a step knows is, and how long the drives wait for their answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.plots.over_time import draw_values


def draw(histories: Sequence[History]) -> Figure:
    """Draw the age of the camera picture at the step [ms] and, on a rig, the time from picture to drives [ms]."""
    on_a_rig = any(np.isfinite(history.answer).any() for history in histories)
    figure, panels = style.time_panels(1 + on_a_rig, height_in=2.0)
    draw_values(panels[0], histories, [1e3 * history.age for history in histories], "ms")
    panels[0].set_ylabel("age of picture [ms]")
    if on_a_rig:
        draw_values(panels[1], histories, [1e3 * history.answer for history in histories], "ms")
        panels[1].set_ylabel("camera to drive [ms]")
    return figure
