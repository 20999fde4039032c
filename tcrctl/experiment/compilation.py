"""Tells the user why a first run takes longer to begin: numba compiles the kernels and keeps them on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def announced_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call ``announce`` once, when the first kernel is compiled in the ``with`` body; never if all are cached.

    Args:
        announce: Is called in the middle of the work, so it should only print.
    """
    from numba.core import event  # heavy

    class _First(event.Listener):
        done = False

        def on_start(self, event: Any) -> None:
            del event
            if not self.done:
                self.done = True
                announce()

        def on_end(self, event: Any) -> None:
            del event

    with event.install_listener("numba:compile", _First()):
        yield
