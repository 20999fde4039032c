"""Held-out error: how well a group is predicted by what the other groups alone would have given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.best import Best
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.polish import polish
from tcrctl.identify.problem import distances
from tcrctl.signals import Array


def held_out_errors(evaluator: Evaluator, used: NDArray[np.bool_], best: Best) -> Array:
    """Mean error of every group (n_groups,) [mm] after an identification without it.

    Each identification goes by least squares from the common answer. NaN where the other groups have fewer
    coordinates than there are unknowns, or where no answer was found.

    Args:
        evaluator: Evaluates the model.
        used: Which coordinates count (n, 3) bool.
        best: The answer from all groups.
    """
    problem = evaluator.problem
    errors = np.full(len(problem.group_names), np.nan)
    unknowns = len(best.x) + len(best.frame.unknowns)
    for group in range(len(errors)):
        out = problem.group == group
        rest = used & ~out[:, None]
        if rest.sum() < unknowns:
            continue
        without = Best.none(best.x, best.frame)
        try:
            polish(evaluator, rest, without)
        except NoEquilibriumError:
            continue
        predicted = evaluator.predict(without.x)
        if predicted is not None:
            points = out & used.any(axis=1)
            errors[group] = distances(without.frame, predicted, problem.measured)[points].mean()
    return errors
