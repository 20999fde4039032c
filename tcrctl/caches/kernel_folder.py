"""The folder of compiled kernels: its name is a digest of everything that their machine code depends on.

Sources of all kernels, versions of the compiler, its options, and the processor. numba's own cache asks for each
kernel whether *its* file has changed, and so takes a kernel for fresh whose callee in another file is not. Here
another state of any of it is another folder, which can be shared by copies of the program, filled once for many
computers, or shipped.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

import llvmlite
import numba
import numpy as np
from numba.core import config
from numba.core.registry import cpu_target

from tcrctl.caches.kernel_sources import PACKAGE, kernel_sources
from tcrctl.caches.places import Place, is_writable, places

#: Folders that are kept beside each other, those used last: other states of the program, other processors.
KEPT: Final = 6
_NAME: Final = "kernels"
_KEY: Final = re.compile(r"[0-9a-f]{16}")
#: Options of the compiler that change what it makes.
_OPTIONS: Final = (
    "OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "ENABLE_AVX", "LOOP_VECTORIZE", "SLP_VECTORIZE",
)  # fmt: skip


class KernelFolder:
    """Where kernels are looked for, and where they are kept.

    Attributes:
        trouble: Why nothing more is kept; empty while all is well.
    """

    def __init__(self, key: str, chosen: Path | None, others: tuple[Place, ...]):
        """Take the key, the folder that the user has chosen, and the others.

        One that the user has chosen is the only one, unless nothing can be written there: then it is the first.
        """
        own = Place(chosen) if chosen else None
        if own and is_writable(own.path):
            others = ()
        self._places = (*([own] if own else []), *others)
        self._name = os.path.join(_NAME, key)
        self._kept: Path | None = None
        self.trouble = ""

    def found(self, file: str) -> Iterator[Path]:
        """Yield where a file may lie, best first."""
        yield from (place.path / self._name / file for place in self._places if place.trusted)

    def kept(self) -> Path | None:
        """Return the folder in which kernels are kept, made if need be; None if nothing can be written anywhere."""
        if self._kept is None and not self.trouble:
            candidates = (place.inside(self._name) for place in self._places)
            self._kept = next((folder for folder in candidates if folder is not None), None)
            if self._kept is None:
                self.trouble = "no folder can be written"
            else:
                used(self._kept)
                prune(self._kept)
        return None if self.trouble else self._kept


@cache
def kernel_folder() -> KernelFolder:
    """Return the folder of this process's kernels."""
    return KernelFolder(
        kernel_key(), chosen_folder(getattr(config, "CACHE_DIR", "")), places(os.environ, PACKAGE)
    )


def chosen_folder(variable: str) -> Path | None:
    """Return the folder that the user has chosen, None if that is none.

    Args:
        variable: Value of ``NUMBA_CACHE_DIR``; also numba's own files may lie there.
    """
    path = Path(os.path.expanduser(variable))  # leaves "~" where no home is known
    return None if not variable or path.parts[0].startswith("~") else path.absolute() / "tcrctl"


def kernel_key(package: Path = PACKAGE, options: Mapping[str, Any] | None = None) -> str:
    """Return the name of the folder, 16 hexadecimal digits.

    Args:
        package: Folder of the program.
        options: The compiler's options, those of this process if None.
    """
    if options is None:
        options = {name: getattr(config, name, None) for name in _OPTIONS}
    content = {
        "sources": kernel_sources(package).digest,
        "python": [sys.version_info[:3], getattr(sys, "abiflags", "")],
        "versions": [numba.__version__, llvmlite.__version__, np.__version__],
        "options": {name: str(value) for name, value in options.items()},
        "processor": cpu_target.target_context.codegen().magic_tuple(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


@cache
def used(folder: Path) -> None:
    """Note, once per process, that a folder was used."""
    with suppress(OSError):
        os.utime(folder)


def prune(folder: Path) -> None:
    """Remove the folders beside one that were used longest ago, all but some.

    Args:
        folder: Stays; others beside it count only if they are named like it.
    """
    with suppress(OSError):
        beside = [f for f in folder.parent.iterdir() if _KEY.fullmatch(f.name) and f != folder and f.is_dir()]
        beside.sort(key=lambda f: f.stat().st_mtime, reverse=True)
        for old in beside[KEPT - 1 :]:
            shutil.rmtree(old, ignore_errors=True)
