"""Held-out error: how well a group is predicted by what the other groups alone would have given.

Static configurations are few, and one more or less matters: each identification without one goes by least squares
from the common answer to its own. Logs are many samples and slow: there one Gauss-Newton step from the common
answer stands for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.best import Best
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.polish import Residuals, polish
from tcrctl.identify.regression import distances
from tcrctl.signals import Array


def held_out_errors(evaluator: Evaluator, residuals: Residuals, answer: Array) -> Array:
    """Return the mean error of every group (n_groups,) [mm] after an identification without it.

    NaN where the other groups have fewer coordinates than there are unknowns, or where no answer was found.

    Args:
        evaluator: Evaluates the model.
        residuals: Those of all groups.
        answer: Parameters and frame unknowns found from all groups.
    """
    regression, used = evaluator.regression, residuals.used
    number = range(len(regression.group_names))
    rest = [used & (regression.group != group)[:, None] for group in number]
    known = [group for group in number if rest[group].sum() >= len(answer)]
    if regression.recordings:
        without = _stepped(residuals, answer, [rest[group] for group in known])
    else:
        without = [_refitted(evaluator, residuals, answer, rest[group]) for group in known]
    errors = np.full(len(regression.group_names), np.nan)
    predictions = evaluator.predict_many([residuals.split(z)[0] for z in without])
    for group, z, predicted in zip(known, without, predictions, strict=True):
        if predicted is not None:
            held = (regression.group == group) & used.any(axis=1)
            errors[group] = distances(residuals.split(z)[1], predicted, regression.measured)[held].mean()
    return errors


def _refitted(evaluator: Evaluator, residuals: Residuals, answer: Array, rest: NDArray[np.bool_]) -> Array:
    """Return the answer from the coordinates ``rest`` (n, 3) alone; NaN if there is none."""
    best = Best.none(*residuals.split(answer))
    try:
        polish(evaluator, rest, best)
    except NoEquilibriumError:
        return np.full_like(answer, np.nan)
    return np.concatenate([best.x, best.frame.unknowns])


def _stepped(residuals: Residuals, answer: Array, rests: list[NDArray[np.bool_]]) -> list[Array]:
    """Return the answers from the coordinates of each of ``rests`` alone, to first order, within the bounds."""
    jacobian, value = residuals.jacobian(answer), residuals.value(answer)
    n, found = len(residuals.evaluator.regression.parameters), []
    for rest in rests:
        kept = rest[residuals.used]
        z = answer - np.linalg.lstsq(jacobian[kept], value[kept], rcond=None)[0]
        z[:n] = np.clip(z[:n], 0.0, 1.0)
        found.append(z)
    return found
