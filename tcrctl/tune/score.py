"""How good a set of settings is: the mean of the worst tenth of its runs, each against what is shipped."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Final

import numpy as np

from tcrctl.study.groups import Run
from tcrctl.study.settings import CASE, EXPERIMENT
from tcrctl.study.values import value_of

#: Part of the runs that counts.
TENTH: Final = 0.1
#: A run that was stopped counts as so many times the usual error.
STOPPED: Final = 100.0

Scales = Mapping[str, float]


def scales(runs: Sequence[Run], measure: str) -> Scales:
    """Return the usual size of a measure for every experiment: its median over the runs that came to their end.

    Args:
        runs: With the shipped settings.
        measure: The measure.
    """
    found: dict[str, list[float]] = {}
    for run, row in runs:
        value = value_of(row, measure)
        if value is not None and math.isfinite(value):
            found.setdefault(run.levels[EXPERIMENT], []).append(abs(value))
    return {name: median(values) or 1.0 for name, values in found.items()}


def score(runs: Sequence[Run], measure: str, sizes: Scales) -> float:
    """Return the mean of the worst tenth of some runs, at least of one, relative to the usual size.

    Args:
        runs: With one set of settings.
        measure: Smaller is better.
        sizes: From :func:`scales`.
    """
    values = []
    for run, row in runs:
        value = value_of(row, measure)
        size = sizes.get(run.levels[EXPERIMENT], 1.0)
        values.append(STOPPED if value is None or not math.isfinite(value) else min(value / size, STOPPED))
    count = max(1, math.ceil(TENTH * len(values) - 1e-9))
    return float(np.mean(np.sort(values)[-count:]))


def by_case(runs: Sequence[Run]) -> dict[str, list[Run]]:
    """Return runs by the case that they belong to."""
    found: dict[str, list[Run]] = {}
    for run, row in runs:
        found.setdefault(run.levels[CASE], []).append((run, row))
    return found
