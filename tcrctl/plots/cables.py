"""What all figures of one quantity per cable share: one panel for one run, one panel per cable to compare runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.plots import style
from tcrctl.signals import Array

Quantity = Callable[[History], Array]


def draw_cables(
    histories: Sequence[History], quantity: Quantity, name: str
) -> tuple[Figure, list[Axes], list[Array]]:
    """Draw a quantity of every cable over time.

    Args:
        histories: The runs.
        quantity: Finds it (n, m) in a run.
        name: Its name and unit, for the axis.

    Returns:
        The figure, its panels, and all values that each of them shows.
    """
    if len(histories) == 1:
        return _together(histories[0], quantity, name)
    count = max(history.drive.shape[1] for history in histories)
    columns = 2 if count > 3 else 1
    figure, panels = style.time_panels(count, height_in=1.3, columns=columns)
    shown: list[list[Array]] = [[] for _ in panels]
    names = max((history.cables for history in histories), key=len)
    for i, history in enumerate(histories):
        for c, values in enumerate(quantity(history).T):
            panels[c].plot(history.t, values, **style.line(i), label=history.label)
            shown[c].append(values)
    for c, (panel, cable) in enumerate(zip(panels, names, strict=True)):
        panel.set_title(cable, loc="left")
        if c % columns == 0:
            panel.set_ylabel(name)
    style.span(panels, histories)
    style.legend(figure, panels)
    return figure, panels, [np.concatenate(values) for values in shown]


def _together(history: History, quantity: Quantity, name: str) -> tuple[Figure, list[Axes], list[Array]]:
    figure, panels = style.time_panels(1, height_in=2.6)
    values = quantity(history)
    for c, cable in enumerate(history.cables):
        panels[0].plot(history.t, values[:, c], **style.line(c), label=cable)
    panels[0].set_ylabel(name)
    style.span(panels, [history])
    style.legend(figure, panels)
    return figure, panels, [values.ravel()]
