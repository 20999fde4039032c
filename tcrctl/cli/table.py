"""Tables on stdout, as wide as the terminal, with a style for each row."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from typing import Final

from tcrctl.cli.console import console, has_styles
from tcrctl.cli.layout import fact, laid_out, width
from tcrctl.visible import visible

#: How runs that did not end well look in a list, by status.
STATUS_STYLES: Final = {
    "success": "",
    "failed": "red",
    "aborted": "red",
    "error": "red",
    "crashed": "red",
    "timeout": "red",
}


def print_table(
    titles: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    styles: Sequence[str] = (),
    right: Sequence[int] = (),
    title: str = "",
) -> None:
    """Print a table; nothing if it has no rows.

    Args:
        titles: Of the columns.
        rows: A text for every column.
        styles: Colour and weight of every row; plain if left out.
        right: Columns of numbers.
        title: What stands above it.
    """
    texts = [[_line(cell) for cell in row] for row in rows]
    if not texts:
        return
    head, bodies = laid_out(titles, texts, width(), right)
    screen = _Screen()
    screen.say([title] if title else [], "italic")
    screen.say(head, "bold")
    for lines, style in zip(bodies, styles or [""] * len(bodies), strict=True):
        screen.say(lines, style)


def print_facts(rows: Iterable[tuple[str, str, str]], title: str = "") -> None:
    """Print names and what belongs to them.

    Args:
        rows: Name, text and style.
        title: What stands above it.
    """
    texts = [(_line(name), _line(text), style) for name, text, style in rows]
    at = max((len(name) for name, _, _ in texts), default=0) + 2
    screen = _Screen()
    screen.say([title] if title else [], "italic")
    for name, text, style in texts:
        screen.say(fact(name, text, at, width()), style, bold=len(name))


def _line(text: str) -> str:
    return visible(" ".join(str(text).split("\n")))


class _Screen:
    """Prints lines as they are, in a style where there are styles."""

    def __init__(self) -> None:
        forced = os.environ.get("FORCE_COLOR") and not os.environ.get("NO_COLOR")
        styled = forced or has_styles(sys.stdout)
        self._console = console() if styled else None  # rich is slow to import

    def say(self, lines: Iterable[str], style: str, bold: int = 0) -> None:
        for i, line in enumerate(lines):
            if self._console is None:
                print(line)
            else:
                self._styled(line, style, 0 if i else bold)

    def _styled(self, line: str, style: str, bold: int) -> None:
        from rich.text import Text

        text = Text(line, style=style)
        text.stylize("bold", 0, bold)
        if self._console is not None:
            self._console.print(text, soft_wrap=True, highlight=False)
