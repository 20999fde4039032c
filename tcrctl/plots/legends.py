"""Legends that leave room for what they explain, in narrow figures too."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.plots.style import width_in

_NO_ROOM: Final = "constrained_layout not applied"
_PT_PER_IN: Final = 72.0
#: Width of a letter, in sizes of the text; letters beside a name that axis and line take; the fewest of a line.
_LETTER_EM: Final = 0.6
_BESIDE: Final = 16
_SHORTEST: Final = 14
_NO_BREAK: Final = "\u00a0"


def panel_legend(panel: Axes, columns: int = 1) -> None:
    """Draw the legend of a panel above it; names that are too long for the figure are broken behind commas.

    Args:
        panel: One that reaches from the left side of the figure to the right one.
        columns: How many short names may stand beside each other.
    """
    handles, names = panel.get_legend_handles_labels()
    letters = width_in() * _PT_PER_IN / mpl.rcParams["legend.fontsize"] / _LETTER_EM
    shown = [broken(name, int(letters) - _BESIDE) for name in names]
    beside = columns if len(names) > 1 else 1
    panel.legend(handles, shown, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=beside, borderaxespad=0.1)


def broken(name: str, letters: int = 0) -> str:
    """Return a name in lines of so many letters, or of the fewest there may be; values stay with their units."""
    whole = name.replace(" ", _NO_BREAK).replace(f",{_NO_BREAK}", ", ").replace(f":{_NO_BREAK}", ": ")
    return textwrap.fill(whole, max(letters, _SHORTEST), break_on_hyphens=False).replace(_NO_BREAK, " ")


@contextmanager
def at_peace(figure: Figure) -> Iterator[None]:
    """Let a figure be saved in the ``with`` body that has no room for its legends: they give way, nobody is warned.

    The layout of matplotlib gives up with a warning on stderr where decorations leave nothing to the panels.
    """
    with warnings.catch_warnings(record=True) as found:
        warnings.filterwarnings("always", _NO_ROOM)
        figure.draw_without_rendering()
    if found:
        for artist in (*figure.legends, *(panel.get_legend() for panel in figure.axes)):
            if artist is not None:
                artist.set_in_layout(False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", _NO_ROOM)
        yield
