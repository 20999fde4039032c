"""Tells the user why a first run takes longer to begin: the kernels are compiled, and kept if there is room."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def announced_compilation(say: Callable[[str], None]) -> Iterator[None]:
    """Say so once, when the first kernel is compiled in the ``with`` body; nothing if all are cached.

    Args:
        say: Takes the sentence; is called in the middle of the work, so it should only print.
    """
    from numba.core import event  # heavy

    class _First(event.Listener):
        told: str | None = None

        def on_start(self, event: Any) -> None:
            del event
            if self.told is None:
                self.told = _sentence()
                say(self.told)

        def on_end(self, event: Any) -> None:
            del event

    listener = _First()
    with event.install_listener("numba:compile", listener):
        yield
    if listener.told is not None and _sentence() != listener.told:  # a full disk, say
        say(_sentence())


def _sentence() -> str:
    from tcrctl.caches.kernel_folder import kernel_folder  # heavy

    folder = kernel_folder()
    kept = folder.kept()
    if kept is not None:
        return f"compiling numerical kernels (first run only) ... kept in {kept}"
    return (
        f"compiling numerical kernels, which cannot be kept: {folder.trouble} (NUMBA_CACHE_DIR names another)"
    )
