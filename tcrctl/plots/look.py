"""How large figures are and what they are written in: for a page, a column, or a wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from tcrctl.errors import InputError, UnknownNameError

#: Two columns of a journal.
WIDTH_MM: Final = 177.8
#: From a stamp to a poster.
WIDTHS_MM: Final = (40.0, 1000.0)
FONT: Final = "DejaVu Sans"  # comes with matplotlib, so that every machine draws the same
#: Text [pt] and lines [pt] by style: for reading, and for showing to a room.
STYLES: Final = {"paper": (9.0, 1.2), "talk": (14.0, 2.2)}
#: Narrower figures than this have smaller text [mm], as in one column of a journal.
_ONE_COLUMN: Final = 120.0
_SMALLER: Final = 0.85
#: Nor has a narrow one larger text than this for its width, whatever the style.
_PT_PER_MM: Final = 0.12
_MM_PER_INCH: Final = 25.4


@dataclass(frozen=True, slots=True)
class Look:
    """What can be chosen.

    Attributes:
        width_mm: Width of a figure.
        font: Family of the text.
        style: One of ``STYLES``.
    """

    width_mm: float = WIDTH_MM
    font: str = FONT
    style: str = "paper"

    def rc(self) -> dict[str, Any]:
        """Return settings of matplotlib.

        Raises:
            InputError: If there is no such font.
        """
        size, line = STYLES[self.style]
        if self.width_mm < _ONE_COLUMN:
            usual, (least, thinnest) = size, STYLES["paper"]
            size = max(_SMALLER * least, min(_SMALLER * size, _PT_PER_MM * self.width_mm))
            line = max(thinnest, line * size / usual)
        return {
            "axes.labelsize": size,
            "axes.linewidth": 0.67 * line,
            "axes.titlesize": size,
            "figure.figsize": (self.width_mm / _MM_PER_INCH, 1.0),  # only the width is taken from here
            "font.family": [_known(self.font), FONT],
            "font.size": size,
            "legend.fontsize": size - 1,
            "lines.linewidth": line,
            "xtick.labelsize": size - 1,
            "ytick.labelsize": size - 1,
        }


#: As figures are if nobody says otherwise.
USUAL: Final = Look()


def checked_look(width_mm: float, font: str, style: str) -> Look:
    """Make a look of what was asked for.

    Raises:
        InputError: If no figure can be so wide, or there is no such font.
        UnknownNameError: If there is no such style.
    """
    if style not in STYLES:
        raise UnknownNameError("style", style, tuple(STYLES))
    low, high = WIDTHS_MM
    if not low <= width_mm <= high:
        raise InputError(f"--width-mm {width_mm:g}: must be from {low:g} to {high:g}")
    _known(font)
    return Look(width_mm, font, style)


def _known(font: str) -> str:
    """Return the name of a font that there is."""
    if font == FONT:
        return font
    from matplotlib import font_manager  # slow to import

    try:
        font_manager.findfont(font, fallback_to_default=False)
    except ValueError:
        names = sorted({entry.name for entry in font_manager.fontManager.ttflist})
        raise UnknownNameError("font", font, names) from None
    return font
