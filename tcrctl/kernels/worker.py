"""A process that compiles the kernels whose numbers it reads, until its parent is gone.

It answers every line with one of its own: ``done``, or ``failed``.
"""

from __future__ import annotations

import gc
import os
import queue
import signal
import sys
import threading
from typing import Final

from tcrctl.caches.kernel_cache import WRITING
from tcrctl.kernels.needed import NeededKernels, dispatcher, read_needed
from tcrctl.kernels.type_words import TypeWords

DONE: Final = "done"
FAILED: Final = "failed"
#: New objects between two collections: with Python's own 700 they take a twentieth of the time.
_COLLECT_AFTER: Final = 50_000


def main() -> None:
    """Work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent gets it too, and decides
    gc.set_threshold(_COLLECT_AFTER, 20, 100)
    asked: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()
    needed = read_needed()
    words = TypeWords(needed.tuples)
    while True:
        print(_answer(needed, words, int(asked.get())), flush=True)


def _listen(asked: queue.SimpleQueue[str]) -> None:
    """Pass lines on, and end the process when there are no more: its parent has ended, however that was."""
    for line in sys.stdin:
        asked.put(line)
    with WRITING:  # a file is there whole or not at all, and nothing is left beside it
        os._exit(0)


def _answer(needed: NeededKernels, words: TypeWords, number: int) -> str:
    one = needed.kernels[number]
    try:
        dispatcher(one.kernel).compile(tuple(words.type_of(word) for word in one.arguments))
    except Exception:  # whatever it is: the run will compile it itself, and say what is wrong
        return FAILED
    return DONE


if __name__ == "__main__":
    main()
