"""Compile what a run needs before it asks for it."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Final

from tcrctl.caches.kernel_folder import kernel_folder
from tcrctl.executors.engine import available_cores
from tcrctl.kernels.crew import Crew, Watch
from tcrctl.kernels.missing import missing
from tcrctl.kernels.needed import read_needed
from tcrctl.kernels.order import Order

#: More processes would wait for the longest way from callee to caller.
MOST: Final = 8
#: For fewer kernels no process is worth its start.
FEW: Final = 4


def compile_ahead(words: Iterable[str], watch: Watch, processes: int | None = None) -> int:
    """Fill the cache with the kernels that runs with some settings need, if there is a cache.

    Args:
        words: Of the settings, as the list of kernels has them.
        watch: Is told how far it is.
        processes: At most so many side by side; as many as there are cores for this process, if None.

    Returns:
        How many kernels could not be compiled ahead.
    """
    count = min(MOST, processes or available_cores())
    if count < 2 or not sys.executable or kernel_folder().kept() is None:
        return 0
    try:
        needed = read_needed()
        tasks = missing(needed, needed.called_with(words))
    except (OSError, ValueError, KeyError, TypeError, IndexError):  # a list that somebody has edited
        return 0
    if len(tasks) < FEW:
        return 0
    crew = Crew(Order(needed, tasks), count)
    crew.work(watch)
    return crew.failed
