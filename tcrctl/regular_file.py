"""Files to read, and nothing that only looks like one: a pipe waits for its writer, a device may never end."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISDIR, "a folder"),
)


def open_file(path: str | Path) -> BinaryIO:
    """Open a regular file to read its bytes.

    Args:
        path: The file; links are followed.

    Raises:
        OSError: If it cannot be opened, or is no regular file; never waits for one.
        ValueError: If the name is none that a file can have.
    """
    _check(os.stat(path), str(path))  # opening alone can rewind a tape, or begin a connection
    return open(path, "rb", opener=_regular)


def other_kind(path: str | Path) -> str:
    """Return what a path leads to that is no regular file, ``a pipe`` or so; empty if it is one, or nothing."""
    try:
        return _kind(os.stat(path).st_mode)
    except (OSError, ValueError):
        return ""


def _regular(name: str, flags: int) -> int:
    """Open without waiting for whoever is at the other end; the path may lead elsewhere by now."""
    descriptor = os.open(name, flags | getattr(os, "O_NONBLOCK", 0))
    try:
        _check(os.fstat(descriptor), name)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _check(found: os.stat_result, path: str) -> None:
    if kind := _kind(found.st_mode):
        raise OSError(errno.EINVAL, f"this is {kind}, not a file", path)


def _kind(mode: int) -> str:
    if stat.S_ISREG(mode):
        return ""
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "something else")
