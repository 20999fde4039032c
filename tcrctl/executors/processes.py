"""Worker processes of this computer: a ``ProcessPoolExecutor`` whose processes never outlive it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.process import BaseProcess
from typing import Final

from tcrctl.executors.workers import Workers

#: Time that a stopped worker has to finish a log before it is killed [s].
GRACE_S: Final = 15.0
_POLL_S: Final = 0.05


@contextmanager
def process_workers(jobs: int, warm: Callable[[], object] | None = None) -> Iterator[Workers]:
    """Start processes when they are needed, and end them with the body: at once if it raises.

    Args:
        jobs: How many.
        warm: Is done by one of them before the body begins; that it fails is no error here.
    """
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _begin)

    def own() -> list[BaseProcess]:
        return [child for child in multiprocessing.active_children() if child not in others]

    def kill() -> None:
        for child in own():
            child.kill()

    try:
        if warm is not None:
            with suppress(Exception):  # whoever needs it will say why it fails
                pool.submit(warm).result()
        yield Workers(pool, jobs, kill)
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        _end(own())
        raise
    pool.shutdown()


def _end(children: list[BaseProcess]) -> None:
    """Ask processes to end, then make them."""
    for child in children:
        child.terminate()
    deadline = time.monotonic() + GRACE_S
    while any(child.is_alive() for child in children) and time.monotonic() < deadline:
        time.sleep(_POLL_S)
    for child in children:
        child.kill()


def _begin() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
