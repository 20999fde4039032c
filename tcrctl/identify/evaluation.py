"""Evaluates the model, one process per core; counts, remembers the best, and ends when a signal has come."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import numpy as np

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.regression import Regression
from tcrctl.identify.workers import Workers, prediction
from tcrctl.signals import Array


def available_cores() -> int:
    """Return the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass
class Evaluator:
    """Runs predictions here or in worker processes, which are started when first needed.

    Attributes:
        regression: What is evaluated.
        jobs: Worker processes; 1 works in this process.
        check: Raises if a signal has come.
        progress: Told the number of evaluations so far.
        evaluations: Predictions of the whole data so far; sensitivities of statics count as one.
    """

    regression: Regression
    jobs: int
    check: Callable[[], None]
    progress: Callable[[int], None] = lambda evaluations: None
    evaluations: int = 0
    _workers: Workers | None = field(default=None, repr=False)

    def predict(self, x: Array) -> Array | None:
        """Return the prediction (n, 3) [m] at ``x`` of the unit cube, None if the robot has no shape there."""
        self.check()
        found = prediction(self.regression, x)
        self.count(1)
        return found

    def predict_many(self, points: Sequence[Array]) -> list[Array | None]:
        """Return the predictions at several points, side by side."""
        if self.jobs == 1 or len(points) == 1:
            return [self.predict(x) for x in points]
        if self._workers is None:
            self._workers = Workers(self.regression, self.jobs)
        return self._workers.predict(points, self._done)

    def slopes(self, x: Array, predicted: Array) -> Array:
        """Return ∂(prediction)/∂x (n, 3, n_parameters): analytic for statics, differences for logs.

        Args:
            x: Place in the unit cube.
            predicted: Prediction there.

        Raises:
            NoEquilibriumError: If the robot has no shape there.
        """
        self.check()
        if not self.regression.recordings:
            found = self.regression.static_slopes(x)
            self.count(1)
            return found
        beside = self.regression.difference_points(x)
        columns = []
        for (_, deviation), there in zip(beside, self.predict_many([p for p, _ in beside]), strict=True):
            if there is None:
                raise NoEquilibriumError("a sensitivity", np.nan, 0.0, 0)
            columns.append((there - predicted) / deviation)
        return np.stack(columns, axis=2)

    def count(self, number: int) -> None:
        """Add evaluations."""
        self.evaluations += number
        self.progress(self.evaluations)

    def _done(self, number: int) -> None:
        self.count(number)
        self.check()

    def __enter__(self) -> Self:
        """Return itself: nothing is started yet."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the worker processes."""
        if self._workers is not None:
            self._workers.close()
