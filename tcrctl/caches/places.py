"""Folders in which caches can be kept: the user's, the program's own, or one for temporary files."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

_PERMISSIONS = 0o170077
_OWN_FOLDER = 0o040000


@dataclass(frozen=True, slots=True)
class Place:
    """A folder that may or may not be there.

    Attributes:
        path: The folder.
        shared: Whether it lies where everybody can make files; then it counts only if it is nobody else's.
    """

    path: Path
    shared: bool = False

    @property
    def trusted(self) -> bool:
        """Whether nobody else can have filled it: what lies in it will be run."""
        return not self.shared or _is_private(self.path)

    def inside(self, name: str) -> Path | None:
        """Return a folder in it that can be written, made if need be; None if there cannot be one."""
        if self.shared:
            _make_private(self.path)
        folder = self.path / name
        return folder if self.trusted and is_writable(folder) else None


def places(environment: Mapping[str, str], package: Path) -> tuple[Place, ...]:
    """Return where caches may lie, best first.

    Args:
        environment: The process's.
        package: Folder of the program.
    """
    cache = user_folder(environment, "XDG_CACHE_HOME", ".cache")
    own = f"tcrctl-{os.getuid() if hasattr(os, 'getuid') else 'caches'}"
    return (
        *([Place(cache / "tcrctl")] if cache else []),
        Place(package / "__pycache__"),
        Place(Path(tempfile.gettempdir()) / own, shared=True),
    )


def user_folder(environment: Mapping[str, str], variable: str, name: str) -> Path | None:
    """Return a folder of the user by the rules of XDG, where relative paths do not count; None if there is none.

    Args:
        environment: The process's.
        variable: XDG's.
        name: Of the folder within the home if the variable is not set.
    """
    chosen = Path(environment.get("LOCALAPPDATA" if sys.platform == "win32" else variable, ""))
    if chosen.is_absolute():
        return chosen
    home = Path(environment.get("HOME", ""))  # an unset one is not looked up: it may be "~", and made as such
    return home / name if home.is_absolute() else None


def is_writable(folder: Path) -> bool:
    """Tell whether files can be made in a folder, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _make_private(folder: Path) -> None:
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return


def _is_private(folder: Path) -> bool:
    try:
        found = folder.lstat()
    except OSError:
        return False
    return not hasattr(os, "getuid") or (
        found.st_uid == os.getuid() and found.st_mode & _PERMISSIONS == _OWN_FOLDER
    )
