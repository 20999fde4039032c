"""Tells the user why a first run takes longer to begin: the kernels are compiled, and kept if there is room."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Final

#: New objects between two collections: with the usual 700 they take a twentieth of the compiler's time.
_COMPILING: Final = (50_000, 20, 100)
#: Takes kernels done and in all, and the seconds that are left, None while that is unknown.
Watch = Callable[[int, int, float | None], None]


def unwatched(done: int, total: int, left: float | None) -> None:
    """Tell nobody."""


@contextmanager
def announced_compilation(
    say: Callable[[str], None], words: Iterable[str] | None = None, watch: Watch = unwatched
) -> Iterator[None]:
    """Say so once, when the first kernel is compiled in the ``with`` body; nothing if all are cached.

    Then everything else that is needed is compiled ahead, on all cores.

    Args:
        say: Takes the sentence; is called in the middle of the work, so it should only print.
        words: Of the settings (:mod:`tcrctl.experiment.kernel_words`); nothing is compiled ahead if None.
        watch: Is told how far that is.
    """
    from numba.core import event  # heavy

    class _First(event.Listener):
        told: str | None = None

        def on_start(self, event: Any) -> None:
            del event
            if self.told is None:
                self.told = _sentence()
                gc.set_threshold(*_COMPILING)
                say(self.told)
                if words is not None:
                    _compile_ahead(say, words, watch)

        def on_end(self, event: Any) -> None:
            del event

    listener, usual = _First(), gc.get_threshold()
    try:
        with event.install_listener("numba:compile", listener):
            yield
    finally:
        gc.set_threshold(*usual)
    if listener.told is not None and _sentence() != listener.told:  # a full disk, say
        say(_sentence())


def _compile_ahead(say: Callable[[str], None], words: Iterable[str], watch: Watch) -> None:
    from tcrctl.kernels.ahead import compile_ahead  # heavy

    failed = compile_ahead(words, watch)
    if failed:
        say(f"{failed} of them could not be compiled ahead; the run compiles them when it needs them")


def _sentence() -> str:
    from tcrctl.caches.kernel_folder import kernel_folder  # heavy

    folder = kernel_folder()
    kept = folder.kept()
    if kept is not None:
        return f"compiling numerical kernels (first run only) ... kept in {kept}"
    return (
        f"compiling numerical kernels, which cannot be kept: {folder.trouble} (NUMBA_CACHE_DIR names another)"
    )
