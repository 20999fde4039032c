"""What the data say and what they do not: covariance, correlation, and combinations that they cannot separate.

With the residuals' derivative J, frame unknowns projected out, cov(ζ) = σ² (J'J)^-1. For the verdict the columns
are scaled by the change of each parameter that matters, its tolerance, and divided by σ: a singular value
below 1 belongs to a combination that the data leave less certain than that.

Length-driven robots have an exact symmetry: all forces, that is moduli, masses, tensions and dampings, times one
factor move nothing. So a scale of forces is only found through what is *assumed* to be known of them. The
initial tension is an assumption of that kind, rarely a measurement: it takes part as one more unknown, loosely
known, and a combination that is uncertain only with it is reported as resting on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tcrctl.identify.parameters import Parameter
from tcrctl.signals import Array

#: A parameter's tolerance is at most this part of its range: else its bounds alone would do.
RANGE_PART = 0.15
#: Standard deviation of what is assumed, as a fraction of its value.
ASSUMED_SPREAD = 0.5
#: Singular values below this fraction of the largest are rounding.
ROUNDING = 1e-9
#: Members of a combination below this fraction of the largest are not named.
NAMED = 0.2


@dataclass(frozen=True, slots=True)
class Combination:
    """A direction in parameter space that the data do not fix.

    Attributes:
        weights: Relative changes by path (absolute ones of parameters that are 0); the largest is 1.
        std: Standard deviation along it, in units of ``weights``; infinite if the data say nothing.
        assumed: Paths of the assumed values on which it rests; empty if it is uncertain whatever is assumed.
    """

    weights: dict[str, float]
    std: float
    assumed: str = ""

    def __str__(self) -> str:
        """Say what is wrong in a sentence."""
        names = ", ".join(f"{path} ({weight:+.2f})" for path, weight in self.weights.items())
        if len(self.weights) == 1 and not np.isfinite(self.std):
            return f"{next(iter(self.weights))} has no influence on the data"
        spread = (
            f"uncertain by {100.0 * self.std:.3g} %" if np.isfinite(self.std) else "not determined at all"
        )
        what = next(iter(self.weights)) if len(self.weights) == 1 else f"the common change of {names}"
        if self.assumed:
            return f"{what} rests on what is assumed, not measured: {self.assumed} (else {spread})"
        return f"{what} cannot be identified from these data ({spread})"


@dataclass(frozen=True, slots=True)
class Certainty:
    """Spread of the parameters.

    Attributes:
        sigma: Standard deviation of a coordinate [mm].
        std: Standard deviation of each parameter, in its unit (n,); infinite if not determined.
        correlation: Correlation matrix (n, n); NaN where not determined.
        combinations: What the data cannot fix, worst first.
    """

    sigma: float
    std: Array
    correlation: Array
    combinations: tuple[Combination, ...]


def certainty(
    parameters: Sequence[Parameter],
    value: Array,
    slopes: Array,
    frame_slopes: Array,
    residual: Array,
    noise: float,
    tolerance: float,
    assumed: tuple[str, Array] | None = None,
) -> Certainty:
    """Judge what least squares found.

    Args:
        parameters: The parameters.
        value: Their values (n,).
        slopes: Derivative of the residual with respect to the values (r, n) [mm per unit].
        frame_slopes: The same with respect to the frame's unknowns (r, f).
        residual: Residual at the answer (r,) [mm].
        noise: Least standard deviation of a coordinate [mm].
        tolerance: Relative uncertainty that counts as not identified.
        assumed: Paths of assumed values, and the derivative with respect to their relative change (r,) [mm].
    """
    freedom = len(residual) - slopes.shape[1] - frame_slopes.shape[1]
    spread = float(np.sqrt(residual @ residual / freedom)) if freedom > 0 else 0.0
    sigma = max(spread, noise)
    if frame_slopes.shape[1]:
        basis = np.linalg.qr(frame_slopes)[0]
        slopes = slopes - basis @ (basis.T @ slopes)
        if assumed is not None:
            assumed = (assumed[0], assumed[1] - basis @ (basis.T @ assumed[1]))
    unit = np.array([_tolerance(p, v, tolerance) for p, v in zip(parameters, value, strict=True)])
    aside = np.zeros(len(slopes)) if assumed is None else assumed[1] * tolerance
    wide = _square(np.column_stack([slopes * unit, aside]) / sigma)
    scaled = wide[:, :-1]
    covariance = _inverse(scaled) * np.outer(unit, unit)
    std = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(std, std)
    found = _combinations(parameters, value, unit, scaled)
    if assumed is not None:
        found += _resting(parameters, value, unit, wide, assumed[0], tolerance / ASSUMED_SPREAD)
    return Certainty(sigma, std, correlation, tuple(found))


def _tolerance(parameter: Parameter, value: float, tolerance: float) -> float:
    """Change of a parameter that matters, in its unit."""
    part = RANGE_PART * parameter.slope(parameter.unit(value))
    return min(tolerance * abs(value), part) if value != 0.0 else part


def _square(tall: Array) -> Array:
    """Return a matrix with the columns' inner products of ``tall`` (r, n), but only n rows or a few more."""
    r: Array = np.asarray(np.linalg.qr(tall, mode="r"))
    return np.vstack([r, np.zeros((tall.shape[1] - len(r), tall.shape[1]))])


def _inverse(scaled: Array) -> Array:
    """Return (S'S)^-1, infinite for parameters with a part in a direction that S does not see."""
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    blind = s <= ROUNDING * max(float(s[0]), 1.0)
    inverse: Array = (vt[~blind].T / s[~blind] ** 2) @ vt[~blind]
    lost = np.abs(vt[blind]).max(axis=0, initial=0.0) > 1e-6
    inverse[np.ix_(lost, lost)] = np.inf
    return inverse


def _combinations(
    parameters: Sequence[Parameter], value: Array, unit: Array, scaled: Array
) -> list[Combination]:
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    return [_combination(parameters, value, unit, vt[k], float(s[k])) for k in np.argsort(s) if s[k] < 1.0]


def _combination(
    parameters: Sequence[Parameter], value: Array, unit: Array, v: Array, s: float, assumed: str = ""
) -> Combination:
    """Return the direction ``v`` in tolerances as relative changes, the largest member 1."""
    change = v * unit / np.where(value != 0.0, np.abs(value), 1.0)
    largest = change[int(np.argmax(np.abs(change)))]
    weights = {
        p.path: float(c / largest)
        for p, c in zip(parameters, change, strict=True)
        if abs(c) > NAMED * abs(largest)
    }
    std = abs(float(largest)) / s if s > ROUNDING else np.inf
    return Combination(weights, std, assumed)


def _resting(
    parameters: Sequence[Parameter],
    value: Array,
    unit: Array,
    wide: Array,
    assumed: str,
    prior: float,
) -> list[Combination]:
    """Return those certain combinations which are so only because of the assumed value.

    The last column of ``wide`` is that of the assumed value; ``prior`` is its tolerance over its spread.
    """
    scaled = wide[:, :-1]
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    certain = vt[s >= 1.0]
    n = len(certain)
    known = np.append(np.zeros(n), prior)
    rows = np.column_stack([scaled @ certain.T, wide[:, -1]])
    _, s, vt = np.linalg.svd(np.vstack([rows, known]), full_matrices=False)
    return [
        _combination(parameters, value, unit, vt[k, :n] @ certain, float(s[k]), assumed)
        for k in np.argsort(s)
        if s[k] < 1.0 and np.linalg.norm(vt[k, :n]) > 0.5
    ]
