"""Tables for people, laid out for the width that there is; text only, without styles.

A row stands on one line if it can. Where it cannot, cells wrap between words; where even that makes a row a tower,
it is written as a paragraph instead: its first cell, and below it every other one with its title. Words are never
broken; a checksum that is longer than a line is shortened. Without a width, which is what a pipe has, every row is
one line, so that line-wise tools find all of it.
"""

from __future__ import annotations

import os
import re
import sys
import textwrap
from collections.abc import Sequence
from typing import Final, TextIO

_GAP: Final = "  "
#: A cell of words is not made narrower than this.
_NARROWEST: Final = 16
#: A row of more lines is a tower; if so large a share of the rows are, all are written as paragraphs.
_TALLEST: Final = 4
_MANY: Final = 0.25
#: A checksum, of which the beginning says as much to a reader; no other word is ever shortened.
_DIGEST: Final = re.compile(r"[0-9a-f]{40,}")
#: Columns of a terminal that does not say.
_USUAL: Final = 80

Lines = list[str]


def width(stream: TextIO | None = None) -> int | None:
    """Return how many columns a stream has; None if it is no terminal and nobody told.

    Args:
        stream: Where the text goes; stdout if left out.
    """
    told, where = os.environ.get("COLUMNS", ""), stream or sys.stdout
    if told.isdecimal() and int(told) > 0:
        return int(told)
    if not where.isatty():
        return None
    try:
        return os.get_terminal_size(where.fileno()).columns or _USUAL
    except (OSError, ValueError):
        return _USUAL


def laid_out(
    titles: Sequence[str], rows: Sequence[Sequence[str]], columns: int | None, right: Sequence[int] = ()
) -> tuple[Lines, list[Lines]]:
    """Return the lines of the head and of every row.

    Args:
        titles: Of the columns.
        rows: A text for every column; no line breaks.
        columns: Width that there is; None for any.
        right: Columns of numbers, which stand at the right.
    """
    cells = [list(titles), *map(list, rows)]
    widths = _widths(cells, columns)
    wrapped = None if widths is None else [_wrapped(row, widths, right) for row in cells]
    if columns is None or wrapped is None or _are_towers(wrapped):
        if columns is not None:
            return [], [_paragraph(titles, row, columns) for row in rows]
        wrapped = [_wrapped(row, _natural(cells), right) for row in cells]
    return wrapped[0], wrapped[1:]


def fact(name: str, text: str, at: int, columns: int | None) -> Lines:
    """Return the lines of a name and what belongs to it, which begins at column ``at`` on every line."""
    room = None if columns is None else columns - at
    if room is None or len(text) <= room:
        return [f"{name.ljust(at)}{text}".rstrip()]
    if columns is not None and len(text) + len(_GAP) > columns and _DIGEST.fullmatch(text):
        text = f"{text[:_NARROWEST]}..."  # all of it is in a wider terminal, a pipe, and JSON
        return [f"{name.ljust(at)}{text}"] if len(text) <= room else [name, f"{_GAP}{text}"]
    if room < max(_NARROWEST, _longest_word(text)):
        return [name, *_words(text, max((columns or 0) - len(_GAP), 1), _GAP)]
    first, *more = _words(text, room)
    return [f"{name.ljust(at)}{first}", *(" " * at + line for line in more)]


def message(text: str, columns: int | None) -> str:
    """Return a message with breaks between words where its lines are too long; styled lines stay as they are."""
    if columns is None or len(text) <= columns:
        return text
    return "".join(_broken(line, columns) for line in text.splitlines(keepends=True))


def _broken(line: str, columns: int) -> str:
    body = line.rstrip("\n")
    if len(body) <= columns or "\x1b" in body:
        return line
    first, *more = _words(body, columns)
    rest = _words(" ".join(more), columns - len(_GAP), _GAP) if more else []
    return "\n".join([first, *rest]) + line[len(body) :]


def _are_towers(rows: Sequence[Lines]) -> bool:
    return sum(len(lines) > _TALLEST for lines in rows) > _MANY * len(rows)


def _natural(cells: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*cells, strict=True)]


def _widths(cells: Sequence[Sequence[str]], columns: int | None) -> list[int] | None:
    """Return widths that fit, the widest column made narrower first; None if there are none."""
    widths = _natural(cells)
    if columns is None:
        return widths
    longest = [max(_longest_word(cell) for cell in column) for column in zip(*cells, strict=True)]
    least = [max(word, min(natural, _NARROWEST)) for word, natural in zip(longest, widths, strict=True)]
    room = columns - len(_GAP) * (len(widths) - 1)
    while sum(widths) > room:
        wide = [i for i in range(len(widths)) if widths[i] > least[i]]
        if not wide:
            return None
        widths[max(wide, key=widths.__getitem__)] -= 1
    return widths


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=0)


def _wrapped(row: Sequence[str], widths: Sequence[int], right: Sequence[int]) -> Lines:
    columns = [_words(text, wide) for text, wide in zip(row, widths, strict=True)]
    lines = []
    for i in range(max(map(len, columns), default=0)):
        parts = [column[i] if i < len(column) else "" for column in columns]
        padded = [
            part.rjust(wide) if c in right else part.ljust(wide)
            for c, (part, wide) in enumerate(zip(parts, widths, strict=True))
        ]
        lines.append(_GAP.join(padded).rstrip())
    return lines


def _paragraph(titles: Sequence[str], row: Sequence[str], columns: int) -> Lines:
    lines = _words(row[0], columns)
    for title, text in zip(titles[1:], row[1:], strict=True):
        if text:
            lines += _words(f"{title}: {text}" if title else text, columns - len(_GAP), _GAP)
    return lines


def _words(text: str, columns: int, indent: str = "") -> Lines:
    lines = textwrap.wrap(text, max(columns, 1), break_long_words=False, break_on_hyphens=False)
    return [indent + line for line in lines] or [""]
