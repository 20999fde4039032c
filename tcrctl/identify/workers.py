"""Worker processes that evaluate one model: each holds the regression, takes places and sends back predictions."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Final

from tcrctl.errors import DivergenceError, NoEquilibriumError, TcrctlError
from tcrctl.identify.regression import Regression
from tcrctl.signals import Array

#: How often a wait looks for signals [s].
_LOOK: Final = 0.1


def prediction(regression: Regression, x: Array) -> Array | None:
    """Return the prediction (n, 3) [m] at ``x`` of the unit cube, None if the robot has no shape there."""
    try:
        return regression.predict(x)
    except (NoEquilibriumError, DivergenceError):
        return None


class Workers:
    """Some processes, started at once and ended with :meth:`close`."""

    def __init__(self, regression: Regression, jobs: int) -> None:
        """Start.

        Args:
            regression: What is evaluated.
            jobs: Number of processes.
        """
        context = multiprocessing.get_context("spawn")
        self._processes: dict[Connection, BaseProcess] = {}
        for _ in range(jobs):
            near, far = context.Pipe()
            process = context.Process(target=_work, args=(regression, far), daemon=True)
            process.start()
            far.close()  # the worker has it; so its end is noticed here
            self._processes[near] = process

    def predict(self, points: Sequence[Array], done: Callable[[int], None]) -> list[Array | None]:
        """Return the predictions at several points of the unit cube, in their order.

        Args:
            points: The points.
            done: Called every now and then with the number of predictions since the last call; may raise, and
                then the workers can only be closed.

        Raises:
            TcrctlError: If a process ended by itself.
        """
        found: dict[int, Array | None] = {}
        waiting = list(enumerate(points))[::-1]
        busy: dict[Connection, int] = {}
        while waiting or busy:
            for worker in self._processes:
                if waiting and worker not in busy:
                    busy[worker], x = waiting.pop()
                    _ask(worker, x)
            ready = [worker for worker in wait(list(busy), timeout=_LOOK) if isinstance(worker, Connection)]
            for worker in ready:
                found[busy.pop(worker)] = _answer(worker)
            done(len(ready))
        return [found[i] for i in range(len(points))]

    def close(self) -> None:
        """Let every process end what it does, and wait for it."""
        for worker in self._processes:
            worker.close()
        for process in self._processes.values():
            process.join()


def _ask(worker: Connection, x: Array) -> None:
    with _noticed_end():
        worker.send(x)


def _answer(worker: Connection) -> Array | None:
    with _noticed_end():
        answer: Array | Exception | None = worker.recv()
    if isinstance(answer, Exception):
        raise answer
    return answer


@contextmanager
def _noticed_end() -> Iterator[None]:
    try:
        yield
    except (EOFError, OSError):
        raise TcrctlError(
            "a worker process ended by itself; perhaps there is not enough memory",
            hint="Try fewer workers: --jobs 1.",
        ) from None


def _work(regression: Regression, boss: Connection) -> None:
    """Predict until nobody asks any more: Ctrl-C is the parent's business, and a worker does not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    try:
        while True:
            x = boss.recv()
            try:
                answer: Array | Exception | None = prediction(regression, x)
            except Exception as error:
                answer = error
            boss.send(answer)
    except (EOFError, OSError):  # the parent has closed
        return


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
