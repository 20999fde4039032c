"""A quiet interpreter for the tick: no garbage collection in it, and on request a real-time priority."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def quiet_interpreter(priority: int | None, warn: Callable[[str], None]) -> Iterator[None]:
    """Keep the garbage collector out of the ``with`` body, and run the calling thread under SCHED_FIFO if asked.

    A collection over the objects of a whole program takes tens of milliseconds. What is alive now is set aside for
    good; what the body leaves behind in cycles is collected after it.

    Args:
        priority: 1 to 99, the higher the more urgent; None for the normal scheduler.
        warn: Takes why the priority was not granted; the body runs all the same.
    """
    gc.collect()
    gc.freeze()
    was_enabled = gc.isenabled()
    gc.disable()
    before = None if priority is None else _raise_priority(priority, warn)
    try:
        yield
    finally:
        if before is not None:
            os.sched_setscheduler(0, *before)
        if was_enabled:
            gc.enable()
        gc.unfreeze()


def _raise_priority(priority: int, warn: Callable[[str], None]) -> tuple[int, os.sched_param] | None:
    """Return the scheduler and parameters to go back to; None if nothing was changed."""
    if not hasattr(os, "sched_setscheduler"):
        warn("this system has no SCHED_FIFO; fifo_priority is ignored")
        return None
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        warn(f"fifo_priority {priority} is not granted ({error.strerror}); see docs/bench.md")
        return None
    return before
