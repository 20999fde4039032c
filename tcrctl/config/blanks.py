"""Characters that look like a space and are none, for YAML: editors and web pages put them into files."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

_BLANK: Final = re.compile("[\u00a0\u1680\u2000-\u200b\u202f\u205f\u2060\u3000\ufeff]")
#: Where YAML needs a space: at the beginning of a line, after a colon, a dash or a comma.
_NEEDED: Final = re.compile(rf"(?m)(?:^[ ]*|[:,\-] *)({_BLANK.pattern})")


def first_blank(text: str) -> int | None:
    """Return where the first such character stands for a space that YAML needs; None if there is none."""
    found = _NEEDED.search(text)
    return None if found is None else found.start(1)


def blank_message(character: str) -> str:
    """Return what is wrong with such a character, a sentence."""
    name = unicodedata.name(character, "").lower()
    return f"not YAML: {name} (U+{ord(character):04X}) where a space is meant"


def outer_blank(text: str) -> str:
    """Return a character of this kind at the beginning or end of a text; empty if there is none."""
    return next((c for c in (text[:1], text[-1:]) if _BLANK.fullmatch(c)), "")
