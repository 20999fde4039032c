"""The sources that compiled kernels depend on: modules with kernels, all that those import, and what that imports.

Only from there on are settings left out: kernels take arrays, and nobody should wait for the compiler because the
description of a key has changed. They are read, not imported: a key is needed before anything is loaded.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

PACKAGE: Final = Path(__file__).parents[1]
#: Parts of the program in which kernels may stand; a test holds that they stand nowhere else.
FOLDERS: Final = (
    "controller", "elements", "estimator", "numerics", "picture", "plant", "robot", "task", "trajectory",
)  # fmt: skip
_KERNEL: Final = b"numerics.kernel import"
_SETTINGS: Final = (b"tcrctl.config", b"pydantic")
_IMPORT: Final = re.compile(
    rb"^[ \t]*(?:from[ \t]+(tcrctl[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+(tcrctl[\w.]*))",
    re.MULTILINE,
)


@dataclass(frozen=True, slots=True)
class KernelSources:
    """Sources as they were read.

    Attributes:
        modules: Names of all modules that count, sorted.
        digest: Of their names and contents, 64 hexadecimal digits.
        stamps: Path of each, time of its last change [ns] and size [bytes].
    """

    modules: frozenset[str]
    digest: str
    stamps: tuple[tuple[str, int, int], ...]

    def unchanged(self) -> bool:
        """Tell whether the files are what they were: else what this process has loaded may be neither state."""
        try:
            return all(_stamp(stamp[0]) == stamp for stamp in self.stamps)
        except OSError:
            return False


@cache
def kernel_sources(package: Path = PACKAGE) -> KernelSources:
    """Read the sources, once per process.

    Args:
        package: Folder of the program.
    """
    paths = dict(_modules(package))
    stamps = {name: _stamp(str(path)) for name, path in paths.items()}  # before they are read
    sources = {name: path.read_bytes() for name, path in paths.items()}
    names = sorted(_reached(sources))
    digest = hashlib.sha256()
    for name in names:
        digest.update(name.encode() + b"\0" + sources[name] + b"\0")
    return KernelSources(frozenset(names), digest.hexdigest(), tuple(stamps[name] for name in names))


def _modules(package: Path) -> Iterator[tuple[str, Path]]:
    """Yield the name and file of every module that could count."""
    paths = [
        *package.glob("*.py"),
        *(path for folder in FOLDERS for path in (package / folder).rglob("*.py")),
    ]
    for path in paths:
        parts = ("tcrctl", *path.relative_to(package).with_suffix("").parts)
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def _reached(sources: Mapping[str, bytes]) -> set[str]:
    """Return the modules with kernels, what they import, and what that imports, but for settings."""
    kernels = {name for name, source in sources.items() if _KERNEL in source}
    settings = {name for name, source in sources.items() if any(word in source for word in _SETTINGS)}
    reached, waiting = set(kernels), list(kernels)
    while waiting:
        importer = waiting.pop()
        known = {name for name in _imported(sources[importer]) if name in sources}
        new = known - reached - (set() if importer in kernels else settings)
        reached |= new
        waiting.extend(new)
    return reached


def _imported(source: bytes) -> Iterator[str]:
    """Yield what a source imports, and names of modules that it could import from packages."""
    for origin, names, module in _IMPORT.findall(source):
        base = (origin or module).decode()
        yield base
        yield from (f"{base}.{name.decode()}" for name in re.findall(rb"\w+", names))


def _stamp(path: str) -> tuple[str, int, int]:
    found = os.stat(path)
    return path, found.st_mtime_ns, found.st_size
