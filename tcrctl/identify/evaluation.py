"""Evaluates the model, one process per core; counts, remembers the best, and ends when a signal has come."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Final, Self

import numpy as np

from tcrctl.errors import DivergenceError, NoEquilibriumError, TcrctlError
from tcrctl.identify.problem import Problem
from tcrctl.signals import Array

#: How often a wait looks for signals [s].
_LOOK: Final = 0.1
_problem: Problem | None = None


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass
class Evaluator:
    """Runs predictions here or in worker processes, which are started when first needed.

    Attributes:
        problem: What is evaluated.
        jobs: Worker processes; 1 works in this process.
        check: Raises if a signal has come.
        progress: Told the number of evaluations so far.
        evaluations: Predictions of the whole data so far; sensitivities of statics count as one.
    """

    problem: Problem
    jobs: int
    check: Callable[[], None]
    progress: Callable[[int], None] = lambda evaluations: None
    evaluations: int = 0
    _pool: ProcessPoolExecutor | None = field(default=None, repr=False)

    def predict(self, x: Array) -> Array | None:
        """Prediction (n, 3) [m] at ``x`` of the unit cube, None if the robot has no shape there."""
        self.check()
        found = _predict(self.problem, x)
        self.count(1)
        return found

    def predict_many(self, points: Sequence[Array]) -> list[Array | None]:
        """Predictions at several points, side by side."""
        if self.jobs == 1 or len(points) == 1:
            return [self.predict(x) for x in points]
        pool = self._started()
        try:
            futures = [pool.submit(_predict_in_worker, x) for x in points]
            self._await(futures)
            return [future.result() for future in futures]
        except BrokenProcessPool:
            raise TcrctlError(
                "a worker process ended by itself; perhaps there is not enough memory",
                hint="Try fewer workers: --jobs 1.",
            ) from None

    def slopes(self, x: Array, predicted: Array) -> Array:
        """∂(prediction)/∂x (n, 3, n_parameters): analytic for statics, differences for logs.

        Args:
            x: Place in the unit cube.
            predicted: Prediction there.

        Raises:
            NoEquilibriumError: If the robot has no shape there.
        """
        self.check()
        if not self.problem.recordings:
            found = self.problem.static_slopes(x)
            self.count(1)
            return found
        beside = self.problem.difference_points(x)
        columns = []
        for (_, step), there in zip(beside, self.predict_many([p for p, _ in beside]), strict=True):
            if there is None:
                raise NoEquilibriumError("a sensitivity", np.nan, 0.0, 0)
            columns.append((there - predicted) / step)
        return np.stack(columns, axis=2)

    def count(self, number: int) -> None:
        """Add evaluations."""
        self.evaluations += number
        self.progress(self.evaluations)

    def _await(self, futures: list[Future[Array | None]]) -> None:
        waiting = set(futures)
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=_LOOK)
                self.count(len(done))
                self.check()
        except BaseException:
            for future in waiting:
                future.cancel()
            raise

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self.jobs, context, _begin_worker, (self.problem,))
        return self._pool

    def __enter__(self) -> Self:
        """Nothing is started yet."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the worker processes."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


def _predict(problem: Problem, x: Array) -> Array | None:
    try:
        return problem.predict(x)
    except (NoEquilibriumError, DivergenceError):
        return None


def _begin_worker(problem: Problem) -> None:
    """Prepare a worker: Ctrl-C is its parent's business, and it does not outlive its parent."""
    global _problem
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    _problem = problem


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def _predict_in_worker(x: Array) -> Array | None:
    assert _problem is not None
    return _predict(_problem, x)
