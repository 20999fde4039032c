"""Tables and bars in colour; what stands in their cells comes from anywhere."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from tcrctl.visible import visible

if TYPE_CHECKING:
    from rich.console import Console


def console(*, stderr: bool = False) -> Console:
    """Return a console on stdout or stderr; only it may send styles and move the cursor."""
    from rich.console import Console

    stream: Any = sys.stderr if stderr else sys.stdout
    return Console(file=getattr(stream, "styled", stream))


def escaped(text: object) -> str:
    """Return something for a cell: no markup in it is obeyed, and nothing in it acts or hides."""
    from rich.markup import escape

    return escape(visible(str(text)))
