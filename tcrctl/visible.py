"""Text from a log or a file, for a terminal or a table: nothing in it can act or hide.

A control character moves a cursor or paints over what stands there; a bidirectional override turns text around; a
cell that begins like a formula is run by a spreadsheet.
"""

from __future__ import annotations

import re
from typing import Final

_ACTING: Final = (
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)
_HIDDEN: Final = re.compile(_ACTING)
_STYLE: Final = re.compile(r"\x1b\[[0-9;]*m")
_STYLE_OR_HIDDEN: Final = re.compile(rf"{_STYLE.pattern}|{_ACTING}")
_FORMULA: Final = tuple("=+-@\t\r\uff1d\uff0b\uff0d\uff20")


def visible(text: str, *, keep_styles: bool = False) -> str:
    r"""Return text with every character that acts or hides spelt out, as ``\x1b`` or ``\u202e``.

    Args:
        text: Anything; line ends and tabs stay.
        keep_styles: Colours and weights of a terminal stay too.
    """
    if keep_styles:
        return _STYLE_OR_HIDDEN.sub(lambda found: found[0] if len(found[0]) > 1 else _spelt(found), text)
    return _HIDDEN.sub(_spelt, text)


def unstyled(text: str) -> str:
    """Return text without the colours and weights of a terminal."""
    return _STYLE.sub("", text)


def _spelt(found: re.Match[str]) -> str:
    number = ord(found[0])
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"


def cell(text: str) -> str:
    """Return text for a cell of a table; what is no number and begins like a formula gets an apostrophe."""
    shown = visible(text)
    if shown == "-" or not shown.lstrip(" ").startswith(_FORMULA):
        return shown
    try:
        float(shown)
    except ValueError:
        return f"'{shown}"
    return shown
