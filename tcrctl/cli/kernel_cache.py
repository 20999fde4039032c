"""Where compiled kernels are kept when the folder of the program cannot be written.

numba keeps them beside the sources. An administrator's install or a read-only medium has no room there; then
they go to the user's cache, and if that cannot be written either, to a folder for temporary files.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Final

import tcrctl

PACKAGE: Final = Path(tcrctl.__file__).parent
VARIABLE: Final = "NUMBA_CACHE_DIR"


def keep_kernels(environment: MutableMapping[str, str], package: Path = PACKAGE) -> None:
    """Set numba's variable to a folder that can be written, unless the one that numba would take can be.

    Args:
        environment: The process's; numba must not be loaded yet.
        package: Where the sources lie.
    """
    given = environment.get(VARIABLE)
    if is_writable(Path(given) if given else package / "elements" / "__pycache__"):
        return
    for folder in _places(environment):
        place = folder / "kernels" / kernel_key(package)
        if is_writable(place):
            environment[VARIABLE] = str(place)
            return


def kernel_key(package: Path = PACKAGE) -> str:
    """Hash of all sources with kernels: numba itself does not notice edits in files that a kernel imports."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        source = path.read_bytes()
        if b"numba" in source:
            digest.update(str(path.relative_to(package)).encode() + b"\0" + source + b"\0")
    return digest.hexdigest()[:16]


def is_writable(folder: Path) -> bool:
    """Tell whether files can be made in a folder, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _places(environment: MutableMapping[str, str]) -> Iterator[Path]:
    """Yield the user's cache, then a temporary folder that is nobody else's: what lies in it will be run."""
    cache = environment.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    home = environment.get("HOME")
    if cache:
        yield Path(cache) / "tcrctl"
    elif home:
        yield Path(home) / ".cache" / "tcrctl"
    shared = Path(tempfile.gettempdir()) / f"tcrctl-{os.getuid() if hasattr(os, 'getuid') else 'kernels'}"
    yield shared if _is_private(shared) else Path(tempfile.mkdtemp(prefix="tcrctl-"))


def _is_private(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return False
    return not hasattr(os, "getuid") or (found.st_uid == os.getuid() and found.st_mode & 0o170077 == 0o040000)
