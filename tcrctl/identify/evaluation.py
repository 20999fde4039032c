"""Evaluates the model, side by side; counts, and ends when a signal has come."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import ExitStack
from dataclasses import dataclass, field
from types import TracebackType
from typing import Final, Self

import numpy as np

from tcrctl.errors import DivergenceError, NoEquilibriumError, TcrctlError
from tcrctl.executors.carried import Carried, carried
from tcrctl.executors.engine import Engine
from tcrctl.executors.workers import Workers
from tcrctl.identify.regression import Regression
from tcrctl.signals import Array

#: How often a wait looks for signals [s].
_LOOK_S: Final = 0.1


def prediction(regression: Regression, x: Array) -> Array | None:
    """Return the prediction (n, 3) [m] at ``x`` of the unit cube, None if the robot has no shape there."""
    try:
        return regression.predict(x)
    except (NoEquilibriumError, DivergenceError):
        return None


def _prediction_at(regression: Carried[Regression], x: Array) -> Array | None:
    return prediction(regression.value, x)


@dataclass
class Evaluator:
    """Runs predictions here or on an executor, whose workers are started when first needed.

    Attributes:
        regression: What is evaluated.
        engine: Where predictions are made; with one job in this process.
        check: Raises if a signal has come.
        progress: Told the number of evaluations so far.
        evaluations: Predictions of the whole data so far; sensitivities of statics count as one.
    """

    regression: Regression
    engine: Engine
    check: Callable[[], None]
    progress: Callable[[int], None] = lambda evaluations: None
    evaluations: int = 0
    _opened: ExitStack = field(default_factory=ExitStack, repr=False)
    _workers: Workers | None = field(default=None, repr=False)
    _parcel: Carried[Regression] | None = field(default=None, repr=False)

    def predict(self, x: Array) -> Array | None:
        """Return the prediction (n, 3) [m] at ``x`` of the unit cube, None if the robot has no shape there."""
        self.check()
        found = prediction(self.regression, x)
        self.count(1)
        return found

    def predict_many(self, points: Sequence[Array]) -> list[Array | None]:
        """Return the predictions at several points, side by side."""
        if self.engine == Engine(jobs=1) or len(points) == 1:
            return [self.predict(x) for x in points]
        if self._workers is None or self._parcel is None:
            self._workers = self._opened.enter_context(self.engine.open())
            self._parcel = carried(self.regression)
        submit = self._workers.executor.submit
        try:
            asked = [submit(_prediction_at, self._parcel, x) for x in points]
            self._wait(asked)
            return [future.result() for future in asked]
        except BrokenExecutor:
            raise TcrctlError(
                "a worker process ended by itself; perhaps there is not enough memory",
                hint="Try fewer workers: --jobs 1.",
            ) from None

    def _wait(self, asked: Sequence[Future[Array | None]]) -> None:
        left: set[Future[Array | None]] = set(asked)
        while left:
            done, left = wait(left, timeout=_LOOK_S, return_when=FIRST_COMPLETED)
            self.count(len(done))
            self.check()

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

    def __enter__(self) -> Self:
        """Return itself: nothing is started yet."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the workers."""
        self._opened.__exit__(kind, error, trace)
