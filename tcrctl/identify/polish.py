"""Bounded least squares over parameters and frame unknowns, with sensitivities of the model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.best import Best
from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.regression import MM
from tcrctl.signals import Array

#: Residual of every coordinate where the robot has no stable shape [mm]; the step is then refused.
NO_SHAPE = 1e4
MAX_EVALUATIONS = 60
#: Relative fall of the sum of squares, and relative step, that end the search.
COST_TOLERANCE = 1e-6
STEP_TOLERANCE = 1e-6


@dataclass
class Residuals:
    """Differences of measured coordinates and their derivatives, at one place at a time.

    Attributes:
        evaluator: Evaluates the model.
        frame: Measurement frame; says what of it is unknown.
        used: Which coordinates count (n, 3) bool.
        best: Takes every improvement.
    """

    evaluator: Evaluator
    frame: CoordinateFrame
    used: NDArray[np.bool_]
    best: Best
    _predicted: tuple[Array, Array | None] | None = None
    _jacobian: tuple[Array, Array] | None = None

    def value(self, z: Array) -> Array:
        """Return the differences [mm] at parameters and frame unknowns z = (x, frame)."""
        x, frame = self.split(z)
        predicted = self._prediction(x)
        if predicted is None:
            return np.full(int(self.used.sum()), NO_SHAPE)
        difference = MM * (frame.place(predicted) - self.evaluator.regression.measured)[self.used]
        self.best.offer(float(difference @ difference), x, frame)
        out: Array = difference
        return out

    def jacobian(self, z: Array) -> Array:
        """Return the derivative of :meth:`value` [mm], (coordinates, unknowns).

        Raises:
            NoEquilibriumError: If the robot has no stable shape there.
        """
        if self._jacobian is not None and np.array_equal(self._jacobian[0], z):
            return self._jacobian[1]
        x, frame = self.split(z)
        predicted = self._prediction(x)
        if predicted is None:
            raise NoEquilibriumError("a sensitivity", np.nan, 0.0, 0)
        slopes = self.evaluator.slopes(x, predicted)
        turned = np.moveaxis(frame.turned(np.moveaxis(slopes, 2, 1)), 1, 2)
        found = MM * np.concatenate([turned, frame.slopes(predicted)], axis=2)[self.used]
        self._jacobian = z.copy(), found
        return found

    def split(self, z: Array) -> tuple[Array, CoordinateFrame]:
        """Return the parameters and frame of the unknowns."""
        n = len(self.evaluator.regression.parameters)
        return z[:n], self.frame.with_unknowns(z[n:])

    def _prediction(self, x: Array) -> Array | None:
        if self._predicted is None or not np.array_equal(self._predicted[0], x):
            self._predicted = x.copy(), self.evaluator.predict(x)
        return self._predicted[1]


def polish(evaluator: Evaluator, used: NDArray[np.bool_], best: Best) -> None:
    """Go from ``best`` to the nearest minimum of the sum of squares within the bounds.

    Args:
        evaluator: Evaluates the model.
        used: Which coordinates count (n, 3) bool.
        best: Where to start; takes every improvement. Its cost becomes the sum of squares [mm2].
    """
    from scipy import optimize

    solve: Any = optimize.least_squares  # a module of the same name confuses the type checker

    residuals = Residuals(evaluator, best.frame, used, best)
    n, unknowns = len(best.x), best.frame.unknowns
    best.cost = np.inf
    if np.all(residuals.value(np.concatenate([best.x, unknowns])) == NO_SHAPE):
        raise NoEquilibriumError("the start of the search", np.nan, 0.0, 0)
    unbounded = np.full(len(unknowns), np.inf)
    solve(
        residuals.value,
        np.concatenate([best.x, unknowns]),
        residuals.jacobian,
        bounds=(np.concatenate([np.zeros(n), -unbounded]), np.concatenate([np.ones(n), unbounded])),
        x_scale="jac",
        ftol=COST_TOLERANCE,
        xtol=STEP_TOLERANCE,
        gtol=None,
        max_nfev=MAX_EVALUATIONS,
    )
