"""One picture of a run: robot, path of its end, the path as a drawing, error; Fig. 10 of [TCR]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.analysis.structure import read_structure
from tcrctl.plots import style
from tcrctl.plots.plan import draw_plan
from tcrctl.plots.space import draw_body, equal_scale


def draw(histories: Sequence[History]) -> Figure:
    """Draw the robot of the first run in the middle of it, the paths of all runs [mm], and their errors."""
    figure, body, drawing, below = _panels()
    _body(body, histories)
    draw_plan(drawing, histories)
    for i, history in enumerate(histories):
        below.plot(history.t, 1e3 * history.position_error, **style.line(i))
    below.set(xlabel="t [s]", ylabel="error [mm]", ylim=(0.0, None))
    style.span([below], histories)
    style.legend(figure, [drawing])
    return figure


def _panels() -> tuple[Figure, Any, Any, Any]:
    """Return a figure, and panels for robot, drawing and error: the robot beside the others, or above them."""
    if style.is_narrow():
        figure = style.new_figure(5.4)
        grid = figure.add_gridspec(3, 1, height_ratios=(2.0, 2.2, 1.0))
        robot, drawing, below = grid[0], grid[1], grid[2]
    else:
        figure = style.new_figure(3.7)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 2.2), height_ratios=(2.2, 1.0))
        robot, drawing, below = grid[:, 0], grid[0, 1], grid[1, 1]
    body = figure.add_subplot(robot, projection="3d")
    return figure, body, figure.add_subplot(drawing), figure.add_subplot(below)


def _body(axes: Any, histories: Sequence[History]) -> None:
    paths = [1e3 * history.position for history in histories]
    shown = list(paths)
    shape = histories[0].shape
    if len(shape):
        nodes = 1e3 * shape[len(shape) // 3]
        draw_body(axes, nodes, read_structure(histories[0].log, len(nodes)))
        shown.append(nodes)
    for i, path in enumerate(paths):
        axes.plot(*path.T, **style.line(i))
    equal_scale(axes, shown, 10.0, zoom=1.2)
    axes.set(xticks=[], yticks=[], xlabel="x", ylabel="y", zlabel="z [mm]")
    size = mpl.rcParams["font.size"]  # labels clear the numbers on the axis, and stay out of the panel below
    axes.xaxis.labelpad, axes.yaxis.labelpad, axes.zaxis.labelpad = -1.4 * size, -1.4 * size, 2.0 * size - 6
    for artist in axes.lines:  # the box is larger than its place
        artist.set_clip_on(False)
        artist.set_in_layout(False)
