"""Tables and bars in colour, where there may be any; what stands in their cells comes from anywhere."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any, Final, TextIO

from tcrctl.visible import visible

if TYPE_CHECKING:
    from rich.console import Console

#: Terminals, as TERM names them, that write what they are sent and nothing else.
_PLAIN: Final = ("dumb", "unknown")


def has_styles(stream: TextIO) -> bool:
    """Whether a stream may be sent escape codes: a terminal that obeys them, and nobody has asked for none.

    NO_COLOR is taken for more than it says: who sets it wants to read or to store plain text.
    """
    if os.environ.get("NO_COLOR"):
        return False
    return stream.isatty() and os.environ.get("TERM", "").lower() not in _PLAIN


def console(*, stderr: bool = False) -> Console:
    """Return a console on stdout or stderr; only it may send styles and move the cursor."""
    from rich.console import Console

    stream: Any = sys.stderr if stderr else sys.stdout
    return Console(file=getattr(stream, "styled", stream))


def escaped(text: object) -> str:
    """Return something for a cell: no markup in it is obeyed, and nothing in it acts or hides."""
    from rich.markup import escape

    return escape(visible(str(text)))
