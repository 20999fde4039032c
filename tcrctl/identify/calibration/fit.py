"""Maximum a posteriori: Gauss-Newton over all rests, what is loose at each of them marginalised.

    min_x  Σ_k w_k (y_k - h_k(x))' C_k^-1 (y_k - h_k(x)) + x' Λ^-1 x,    C_k = σ² I + L_k L_k'

with L_k what one standard deviation of each loose quantity does at rest k, and weights w_k that fall for rests that
fit much worse than the others (Student's distribution). The posterior covariance is (J'C^-1J + Λ^-1)^-1.

Rests may be looser than assumed: C_k is taken s² times as large, s² the mean square of the whitened residuals, as
long as that is above 1. So nothing far from the truth, where the shapes are not linear in the unknowns, outweighs
what is known beforehand, and a robot that never fits as well as assumed is told with the certainty that it has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.rests import Rests
from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.identify.calibration.shapes import Shape, Shapes
from tcrctl.identify.calibration.sight import Sight
from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.signals import Array

#: Longest step, in prior standard deviations of one unknown.
LONGEST: Final = 3.0
#: A step below this, in the same measure, is the last one.
SMALL: Final = 0.02
#: A step to a robot without a stable shape is halved so many times.
HALVINGS: Final = 8
#: Degrees of freedom of Student's distribution over rests.
FREEDOM: Final = 4.0


@dataclass(frozen=True, slots=True)
class Fit:
    """What was found.

    Attributes:
        x: Unknowns (n,).
        covariance: Of them (n, n).
        residual: Reported minus predicted markers (k, 3 n_markers) [m]; NaN where not seen.
        weight: Of every rest (k,).
        misfit: Weighted mean square of the whitened residuals; 1 if rests are as loose as assumed.
        iterations: Steps taken.
        converged: The last step was small.
    """

    x: Array
    covariance: Array
    residual: Array
    weight: Array
    misfit: float
    iterations: int
    converged: bool


#: Slopes by x over its prior and residuals of a rest, both in standard deviations; and the residuals as they are.
Row = tuple[Array, Array, Array]


class Calibrator:
    """One robot, its rests and what is assumed of them."""

    def __init__(self, body: Body, rests: Rests, spec: SelfCalibrationSpec) -> None:
        self.body, self._rests, self._spec = body, rests, spec
        self._sight = Sight(body.unknowns, body.robot.n_modules)
        self._shapes = Shapes(body, rests, spec.rest)

    def fit(self, start: Array | None = None, told: Callable[[int], None] = lambda steps: None) -> Fit:
        """Find the unknowns.

        Args:
            start: Where to begin (n,), or as near to it as the robot has stable shapes; zeros if None.
            told: Takes the number of steps so far.

        Raises:
            NoEquilibriumError: If the robot as described has no stable shape at a rest, or none on the way.
        """
        prior = self.body.unknowns.prior
        nowhere = np.zeros(prior.size)
        x, rows = self._towards(nowhere, nowhere if start is None else start)
        step, k = np.inf, 0
        while True:
            weight = self._weights([residual for _, residual, _ in rows])
            J = np.vstack([np.sqrt(w) * slopes for w, (slopes, _, _) in zip(weight, rows, strict=True)])
            r = np.concatenate([np.sqrt(w) * res for w, (_, res, _) in zip(weight, rows, strict=True)])
            looser = max(1.0, _mean_square(r))
            information = J.T @ J / looser + np.eye(prior.size)
            told(k)
            if step < SMALL or k == self._spec.iterations:
                break
            move = np.linalg.solve(information, J.T @ r / looser - x / prior)
            step, k = float(np.abs(move).max()), k + 1
            x, rows = self._towards(x, prior * move * (LONGEST / max(step, LONGEST)))
        covariance = np.linalg.inv(information) * np.outer(prior, prior)
        residual = np.array([raw for _, _, raw in rows])
        return Fit(x, covariance, residual, weight, _mean_square(r), k, step < SMALL)

    def _towards(self, x: Array, move: Array) -> tuple[Array, list[Row]]:
        """Go from unknowns x (n,) by as much of a move as leaves stable shapes everywhere; return the rows, too."""
        for _ in range(HALVINGS):
            try:
                shapes = list(self._shapes.at(x + move))
            except NoEquilibriumError:
                move = 0.5 * move
            else:
                return x + move, [self._whitened(x + move, i, shape) for i, shape in enumerate(shapes)]
        return x, [self._whitened(x, i, shape) for i, shape in enumerate(self._shapes.at(x))]

    def residual(self, x: Array) -> Array:
        """Return reported minus predicted markers (k, 3 n_markers) [m]; NaN at a rest without a stable shape."""
        found = np.full((len(self._rests.t), math.prod(self._rests.markers.shape[1:])), np.nan)
        for i, shape in enumerate(self._shapes.where_stable(x)):
            if shape is not None:
                found[i] = self._raw(x, i, shape)[0]
        return found

    def _raw(self, x: Array, i: int, shape: Shape) -> tuple[Array, Array]:
        predicted, slopes = self._sight.of(x, shape)
        return self._rests.markers[i].ravel() - predicted, slopes

    def _whitened(self, x: Array, i: int, shape: Shape) -> tuple[Array, Array, Array]:
        """Slopes by x over its prior, and residuals, both in standard deviations; and the residuals as they are."""
        raw, slopes = self._raw(x, i, shape)
        seen = np.isfinite(raw)
        turn = matrix_from_quaternion(quaternion_exp(self.body.unknowns.take(x, "frame_rotation")))
        loose = self._sight.turned(turn, shape.loose)[seen]
        root = np.linalg.cholesky(spread(loose, 1e-6 * self._spec.rest.noise_um))
        white = np.linalg.solve(root, np.column_stack([slopes[seen] * self.body.unknowns.prior, raw[seen]]))
        return white[:, :-1], white[:, -1], raw

    @staticmethod
    def _weights(residuals: list[Array]) -> Array:
        """Weights (k,) of rests with whitened residuals, by their size against that of the middle one."""
        size = np.array([_mean_square(r) for r in residuals])
        middle = max(float(np.median(size)), 1e-12)
        return np.asarray(np.minimum(1.0, (FREEDOM + 1.0) / (FREEDOM + size / middle)))


def _mean_square(r: Array) -> float:
    return float(r @ r) / max(r.size, 1)


def spread(loose: Array, noise: float) -> Array:
    """Return the covariance (n, n) of markers that are ``noise`` [m] apart, and loose (n, n_loose) [m]."""
    return np.asarray(noise**2 * np.eye(loose.shape[0]) + loose @ loose.T)
