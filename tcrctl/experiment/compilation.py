"""Tells the user why a first run takes longer to begin: numba compiles the kernels and keeps them on disk."""

from __future__ import annotations

import os
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
        done = False

        def on_start(self, event: Any) -> None:
            del event
            if not self.done:
                self.done = True
                say(_sentence())

        def on_end(self, event: Any) -> None:
            del event

    with event.install_listener("numba:compile", _First()):
        yield


def _sentence() -> str:
    kept = os.environ.get("NUMBA_CACHE_DIR")
    return "compiling numerical kernels (first run only) ..." + (f" kept in {kept}" if kept else "")
