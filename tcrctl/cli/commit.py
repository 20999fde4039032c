"""Which commit of a source checkout the program is; read from git's files, so that it takes no time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

_HASH: Final = re.compile(r"[0-9a-f]{40}(?:[0-9a-f]{24})?")


def commit(root: Path) -> str:
    """Return the hash of the commit that is checked out.

    Args:
        root: Folder that may be the top of a checkout, or of a worktree of one.

    Returns:
        The hash; empty if there is none, or git's files are not as they should be.
    """
    try:
        found = _commit(_git_folder(root / ".git"))
    except (OSError, ValueError):  # ValueError: no text
        return ""
    return found if _HASH.fullmatch(found) else ""


def _git_folder(entry: Path) -> Path:
    """Return the folder that a worktree's ``.git`` leads to, or itself."""
    if entry.is_dir():
        return entry
    return entry.parent / entry.read_text().removeprefix("gitdir:").strip()


def _commit(folder: Path) -> str:
    head = (folder / "HEAD").read_text().strip()
    if not head.startswith("ref: "):
        return head
    name = head.removeprefix("ref: ")
    shared = folder / "commondir"
    common = folder / shared.read_text().strip() if shared.is_file() else folder
    for place in (folder / name, common / name):
        if place.is_file():
            return place.read_text().strip()
    packed = (line.split() for line in (common / "packed-refs").read_text().splitlines())
    return next((words[0] for words in packed if words[1:] == [name]), "")
