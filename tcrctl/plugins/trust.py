"""Whose code may run, and where the files are that name it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Trust:
    """Whose code may run.

    Attributes:
        folder: Where relative paths of files start.
        files: Whether a file or module may be run because a file of settings names it; what ``--set`` names, and
            kinds that are registered by installed packages, may always.
        by_name: Files lie in the folder itself, whatever the path before their name is.
    """

    folder: Path
    files: bool = True
    by_name: bool = False

    def file(self, place: str) -> Path:
        """Return the file that a path in a file of settings means."""
        given = Path(place).expanduser()
        return self.folder / (given.name if self.by_name else given)
