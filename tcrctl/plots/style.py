"""How all figures look: legible in print, and in black and white, and to the colour-blind."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.analysis.history import History
from tcrctl.analysis.references import shared
from tcrctl.plots.look import USUAL, Look
from tcrctl.signals import Array

BLACK: Final = "#000000"
BLUE: Final = "#0072b2"
VERMILION: Final = "#d55e00"
GREEN: Final = "#009e73"
PURPLE: Final = "#cc79a7"
SKY: Final = "#56b4e9"
ORANGE: Final = "#e69f00"
GREY: Final = "#8c8c8c"
#: The palette of Okabe and Ito, which the colour-blind can tell apart; its yellow is too light on paper.
COLOURS: Final = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE, BLACK)
#: Colour is never the only difference between two lines. 7 colours and 4 dashes make 28 styles.
DASHES: Final[tuple[Any, ...]] = ("-", (0, (5, 1.5)), (0, (5, 1.5, 1, 1.5)), (0, (1.5, 1.2)))

#: Width that heights and legends are made for [in].
_USUAL_IN: Final = 7.0
_USUAL_PT: Final = 9.0
#: Two panels beside each other need so much with usual text [in].
_TWO_PANELS_IN: Final = 4.0
_STYLE: Final[Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#404040",
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=COLOURS),
    "figure.dpi": 100,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "pdf.fonttype": 42,  # text stays text
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "svg.hashsalt": "tcrctl",  # the same figure is the same file
}


@contextmanager
def printed(look: Look = USUAL) -> Iterator[None]:
    """Let figures be drawn and saved in this style in the ``with`` body; the user's own style is left alone."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE | look.rc())
        yield


def new_figure(height_in: float) -> Figure:
    """Empty figure as wide as asked, taller for larger text; no window, no global state."""
    taller = max(1.0, mpl.rcParams["font.size"] / _USUAL_PT)
    return Figure(figsize=(width_in(), height_in * taller), layout="constrained")


def width_in() -> float:
    """Return the width that figures have now [in]."""
    return float(mpl.rcParams["figure.figsize"][0])


def is_narrow() -> bool:
    """Whether two panels beside each other would have no room for their legends."""
    return bool(width_in() < _TWO_PANELS_IN * mpl.rcParams["font.size"] / _USUAL_PT)


def time_panels(count: int, *, height_in: float = 1.5, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``count`` panels that share the time axis; ``height_in`` is that of one row."""
    rows = -(-count // columns)
    figure = new_figure(height_in * rows + 0.6)
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    panels = list(grid.ravel())
    for unused in panels[count:]:
        unused.remove()
    for column in range(columns):
        below = [i for i in range(count) if i % columns == column]
        panels[below[-1]].set_xlabel("t [s]")
        panels[below[-1]].tick_params(labelbottom=True)
    return figure, panels[:count]


def span(panels: Sequence[Axes], histories: Sequence[History]) -> None:
    """Let the time axis end where the longest run does."""
    first = min(history.t[0] for history in histories)
    last = max(history.t[-1] for history in histories)
    for panel in panels:
        panel.set_xlim(first, last if last > first else first + 1.0)
    figure = panels[0].get_figure(root=True)
    if isinstance(figure, Figure):
        figure.align_ylabels(panels)


def line(index: int) -> dict[str, Any]:
    """Return the colour and dashes of the ``index``-th of several equal lines."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index % len(DASHES)]}


def compare(
    panels: Sequence[Axes], histories: Sequence[History], actual: Sequence[Array], wanted: Sequence[Array]
) -> None:
    """Draw what was wanted and what was reached, one panel per component.

    Args:
        panels: One per component.
        histories: The runs.
        actual: Of every run (n, components).
        wanted: Of every run (n, components); drawn once if the runs wanted the same.
    """
    for i, (history, reached) in enumerate(zip(histories, actual, strict=True)):
        for panel, values in zip(panels, reached.T, strict=True):
            panel.plot(history.t, values, **line(i), label=_reached_label(histories, i))
    whole = shared(histories, wanted)
    for i in range(len(histories)) if whole is None else (whole,):
        name = "wanted" if whole is not None else f"wanted, {histories[i].label}"
        colour = BLACK if whole is not None else line(i)["color"]
        for panel, values in zip(panels, wanted[i].T, strict=True):
            if np.isfinite(values).any():
                panel.plot(histories[i].t, values, color=colour, ls=(0, (2, 2)), lw=0.9, label=name)


def _reached_label(histories: Sequence[History], i: int) -> str:
    return "actual" if len(histories) == 1 else histories[i].label


def legend(figure: Figure, panels: Sequence[Axes]) -> None:
    """Draw one legend above all panels, every name once."""
    found: dict[str, Any] = {}
    for panel in panels:
        handles, names = panel.get_legend_handles_labels()
        found |= {name: handle for name, handle in zip(names, handles, strict=True) if name not in found}
    if found:
        room = width_in() / _USUAL_IN * _USUAL_PT / mpl.rcParams["font.size"]
        columns = max(1, min(len(found), int(room * (8 if max(map(len, found)) < 12 else 3))))
        figure.legend(list(found.values()), list(found), loc="outside upper center", ncols=columns)


def limit(panel: Axes, values: Array, bounds: Sequence[float | None], name: str, unit: str) -> None:
    """Draw limits where the values come near them; else say in the panel's title where they are.

    Args:
        panel: Where.
        values: Everything that is drawn there.
        bounds: One limit, or the lower and the upper one; None where there is none.
        name: What it is called.
        unit: Its unit.
    """
    known = [bound for bound in bounds if bound is not None] if np.isfinite(values).any() else []
    near = [bound for bound in known if _is_near(bound, values)]
    for bound in near:
        _draw_limit(panel, bound, f"{name} {bound:g} {unit}")
    if known and not near:
        text = f"±{known[1]:g}" if known[0] == -known[-1] else " to ".join(f"{bound:g}" for bound in known)
        said = panel.get_title(loc="right")
        note = f"{said}{', ' if said else ''}{name} {text} {unit}".replace("-", "−")
        panel.set_title(note, loc="right", fontsize="small", color="#505050")


def _is_near(bound: float, values: Array) -> bool:
    """Tell if drawing the limit too leaves most of the panel to the values."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    reach = max(0.35 * (high - low), 0.1 * max(abs(low), abs(high)))
    return low - reach <= bound <= high + reach


def _draw_limit(panel: Axes, bound: float, text: str) -> None:
    low, high = panel.get_ylim()
    room = 0.08 * (high - low)
    panel.set_ylim(min(low, bound - room), max(high, bound + room))
    panel.axhline(bound, color=GREY, lw=1.0, ls=(0, (6, 2)))
    panel.annotate(
        text.replace("-", "−"),
        (1.0, bound),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 2 if bound >= 0 else -2),
        textcoords="offset points",
        ha="right",
        va="bottom" if bound >= 0 else "top",
        fontsize="small",
        color="#505050",
        bbox={"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.6},
        zorder=5,
    )
