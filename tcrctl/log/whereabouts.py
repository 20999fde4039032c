"""Whether the file that was written is still the one that its path leads to."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import IO, Final

_GONE: Final = " (deleted)"  # how Linux marks it


def displaced(stream: IO[bytes], path: Path) -> str:
    """Return what has become of an open file that its path does not lead to any more; empty if it still does.

    Args:
        stream: The file.
        path: Where it was made.
    """
    try:
        written = os.fstat(stream.fileno())
    except (OSError, ValueError, AttributeError):  # no file of a file system
        return ""
    with suppress(OSError):
        if os.path.samestat(written, path.stat()):
            return ""
    if written.st_nlink == 0:
        return "it was deleted while it was written, and what was recorded is lost"
    return f"it was moved while it was written{_place(stream)}"


def _place(stream: IO[bytes]) -> str:
    try:
        place = os.readlink(f"/proc/self/fd/{stream.fileno()}")
    except OSError:
        return ""
    return "" if place.endswith(_GONE) else f"; what was recorded is in {place}"
