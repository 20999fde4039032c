"""Gives numba and matplotlib their caches at the moment when they are loaded, whoever loads them.

Both take long to import, so that is left to who needs them; and every process comes by here first, the command
line, a script, or a worker that unpickles its work, because the package itself does. Only kernels of this program
are concerned.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType
from typing import Any, Final

_DISPATCHER: Final = "numba.core.dispatcher"


def watch_imports() -> None:
    """Begin."""
    loaded = sys.modules.get(_DISPATCHER)
    if loaded is not None:
        give_kernels_their_cache(loaded)
    sys.meta_path.insert(0, _Watch())


def give_kernels_their_cache(dispatcher: ModuleType) -> None:
    """Make numba use :class:`tcrctl.caches.kernel_cache.KernelCache` for kernels of this program.

    Args:
        dispatcher: The module of numba in which the cache of every kernel is made.
    """
    theirs: Callable[..., Any] = dispatcher.FunctionCache

    def cache_of(function: Callable[..., Any]) -> Any:
        return _own_cache(function) if function.__module__.startswith("tcrctl.") else theirs(function)

    dispatcher.FunctionCache = cache_of  # type: ignore[attr-defined]


def _own_cache(function: Callable[..., Any]) -> Any:
    # heavy, and they want numba as a whole, which it is not before there is a kernel
    from numba.core.caching import NullCache

    from tcrctl.caches.kernel_cache import KernelCache
    from tcrctl.caches.kernel_sources import kernel_sources

    if function.__module__ in kernel_sources().modules:
        return KernelCache(function)
    return NullCache()  # what the key does not cover could be stale


class _Watch:
    """A finder of modules that finds nothing by itself, but sees what is looked for."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname == "matplotlib":
            from tcrctl.caches.fonts import place_fonts  # every process comes by here, and few draw

            place_fonts(os.environ)
        if fullname != _DISPATCHER:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Dispatcher(spec.loader.name, spec.loader.path)
        return spec


class _Dispatcher(SourceFileLoader):
    """Loads that module of numba."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        give_kernels_their_cache(module)
