"""The cache of one kernel: what numba asks for a compiled kernel, and hands a new one to.

One file per kernel and types of arguments, with a digest in front: a file that is damaged is removed and compiled
anew, one that cannot be read or written costs time and nothing else. There is no index, so that several processes
can fill one folder: numba's own keeps one per kernel, from which the slower of two writers drops what the faster
one has entered.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final
from uuid import uuid4

from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.registry import cpu_target
from numba.core.serialize import dumps

from tcrctl.caches.kernel_folder import kernel_folder, used
from tcrctl.caches.kernel_sources import kernel_sources
from tcrctl.regular_file import open_file

#: Is held while a file is written, which a process that ends on its own may wait for.
WRITING: Final = threading.Lock()
_DIGEST: Final = hashlib.sha256().digest_size


class KernelCache(FunctionCache):
    """Of one kernel, for all types of arguments."""

    def __init__(self, function: Callable[..., Any]):
        """Take the function that the kernel is made of; its sources count as they are now."""
        self._py_func = function
        self._name = repr(function)
        self._impl = _Packing(function)
        self._sources = kernel_sources()
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """Folder in which kernels are kept; empty if nothing can be written."""
        return str(kernel_folder().kept() or "")

    def flush(self) -> None:
        """Forget nothing: other sources have another folder."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled kernel, or None if it has to be compiled."""
        target_context.refresh()
        if not self._enabled or not self._sources.unchanged():
            return None
        key = self._key(sig, target_context.codegen())
        for path in kernel_folder().found(self._file(key)):
            found = self._read(path, key, target_context)
            if found is not None:
                used(path.parent)
                return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel that was compiled, if it can be kept."""
        if not self._enabled or not self._impl.check_cachable(data) or not self._sources.unchanged():
            return
        folder = kernel_folder().kept()
        if folder is None:
            return
        key = self._key(sig, data.codegen)
        content: bytes = dumps((key, self._impl.reduce(data)))  # type: ignore[no-untyped-call]
        try:
            _write(folder / self._file(key), hashlib.sha256(content).digest() + content)
        except OSError as error:
            kernel_folder().trouble = str(error)

    def holds(self, sig: Any) -> bool:
        """Tell whether there is a file for some types of arguments, whatever is in it."""
        file = self._file(self._key(sig, cpu_target.target_context.codegen()))
        return any(path.exists() for path in kernel_folder().found(file))

    def _key(self, sig: Any, codegen: Any) -> Any:
        """Return types, processor, and bytecode with what a closure holds."""
        return self._index_key(sig, codegen)  # type: ignore[no-untyped-call]

    def _file(self, key: Any) -> str:
        name = f"{self._py_func.__module__}.{self._py_func.__qualname__}".removeprefix("tcrctl.")
        words = hashlib.sha256(str(key).encode()).hexdigest()[:16]
        return f"{name.replace('<', '').replace('>', '')}-{words}.nbc"

    def _read(self, path: Path, key: Any, target_context: Any) -> Any:
        try:
            with open_file(path) as file:
                content = file.read()
        except OSError:
            return None
        try:
            if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
                raise ValueError("damaged")
            found, packed = pickle.loads(content[_DIGEST:])
            return self._impl.rebuild(target_context, packed) if found == key else None
        except Exception:  # whatever it is that cannot be unpacked: it is compiled anew
            with suppress(OSError):
                path.unlink()
            return None


class _Packing(CompileResultCacheImpl):
    """numba's way to pack a compiled kernel, without its search for a folder."""

    def __init__(self, function: Callable[..., Any]):
        self._locator = SimpleNamespace(_py_file=function.__code__.co_filename)  # for its warnings
        self._lineno = function.__code__.co_firstlineno


def _write(path: Path, content: bytes) -> None:
    """Write a file that is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)  # another process may have pruned it
    part = path.with_name(f"{uuid4().hex}.part")
    with WRITING:
        try:
            part.write_bytes(content)
            os.replace(part, path)
        except OSError:
            with suppress(OSError):
                part.unlink()
            raise
