"""One figure of an identification: errors before, after and held out, and what the data say of the parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tcrctl.errors import DeviceError
from tcrctl.identify.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BEFORE, _AFTER, _HELD_OUT = "0.7", "tab:blue", "tab:orange"


def save_figure(result: Result, path: Path) -> None:
    """Draw a result.

    Args:
        result: What was found.
        path: Where the figure goes; the suffix says which format.

    Raises:
        DeviceError: If it cannot be written.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    errors, spread, correlation = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.0))
    _draw_errors(errors, result)
    _draw_parameters(spread, result)
    _draw_correlation(correlation, result)
    figure.suptitle(f"{result.spec}: {result.robot} -> {result.new_robot}", fontsize=10)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror}") from error


def _draw_errors(axes: Axes, result: Result) -> None:
    names = [group.name for group in result.groups]
    rows = np.arange(len(names), dtype=float)
    bars = (
        ("before", _BEFORE, [group.before_mm for group in result.groups]),
        ("after", _AFTER, [group.after_mm for group in result.groups]),
        ("held out", _HELD_OUT, [group.held_out_mm for group in result.groups]),
    )
    for shift, (label, colour, lengths) in zip((-0.27, 0.0, 0.27), bars, strict=True):
        axes.barh(rows + shift, np.nan_to_num(lengths), height=0.25, color=colour, label=label)
    axes.set_yticks(rows, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("mean error [mm]")
    axes.legend(fontsize=8)


def _draw_parameters(axes: Axes, result: Result) -> None:
    """Draw values with two standard deviations, as places within their bounds."""
    for row, (p, value) in enumerate(zip(result.parameters, result.values, strict=True)):
        place = p.unit(float(value))
        axes.plot([0.0, 1.0], [row, row], color=_BEFORE, linewidth=1.0)
        axes.plot(p.unit(p.start), row, "|", color="0.3", markersize=12)
        if result.certainty is not None and np.isfinite(result.certainty.std[row]):
            half = 2.0 * float(result.certainty.std[row]) / p.slope(place)
            ends = np.clip([place - half, place + half], 0.0, 1.0)
            axes.plot(ends, [row, row], color=_AFTER, linewidth=4.0, alpha=0.4)
        axes.plot(place, row, "o", color=_AFTER)
        axes.text(0.0, row - 0.18, f"{p.path} = {value:.5g}", fontsize=7)
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(len(result.parameters) - 0.4, -0.6)
    axes.set_yticks([])
    axes.set_xlabel("place within the bounds\n(tick: start, bar: two standard deviations)", fontsize=8)


def _draw_correlation(axes: Axes, result: Result) -> None:
    if result.certainty is None:
        axes.set_axis_off()
        return
    n = len(result.parameters)
    axes.imshow(np.nan_to_num(result.certainty.correlation), vmin=-1.0, vmax=1.0, cmap="coolwarm")
    for i in range(n):
        for j in range(n):
            value = result.certainty.correlation[i, j]
            axes.text(
                j, i, f"{value:.2f}" if np.isfinite(value) else "?", ha="center", va="center", fontsize=8
            )
    short = [p.path.partition(".")[2] or p.path for p in result.parameters]
    axes.set_xticks(range(n), short, rotation=30, ha="right", fontsize=7)
    axes.set_yticks(range(n), short, fontsize=7)
    axes.set_title("correlation", fontsize=9)
