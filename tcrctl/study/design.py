"""The cells of a study: every combination of what differs, in an order that never changes."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, cast

from tcrctl.study.axes import Axis, NormalSettings, RangeSettings
from tcrctl.study.settings import CASE, EXPERIMENT, SAMPLED, StudySpec

#: A normal distribution is cut off here, in standard deviations.
CUT_OFF = 3.0


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination.

    Attributes:
        experiment: Which experiment, as the study names it.
        case: Name of the case; None if there are none.
        values: What ``vary`` gives, by key.
    """

    experiment: str
    case: str | None
    values: Mapping[str, Any]

    def changes(self, spec: StudySpec) -> dict[str, Any]:
        """Return settings by dotted key, in the order in which they apply."""
        case = {} if self.case is None else spec.cases[self.case]
        kept = {key: value for key, value in spec.set.items() if key not in case}
        return {**kept, **case, **self.values}

    def levels(self, experiment: str) -> dict[str, str]:
        """Return factor by factor what it has, as text for tables.

        Args:
            experiment: Name of the experiment.
        """
        case = {} if self.case is None else {CASE: self.case}
        return {EXPERIMENT: experiment, **case, **{key: shown(value) for key, value in self.values.items()}}


def shown(value: Any) -> str:
    """Return a value as it would be written in a file."""
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


def cells(spec: StudySpec) -> Iterator[Cell]:
    """Yield every cell of a study."""
    points = list(_points(spec))
    for experiment in spec.experiments:
        for case in spec.cases or (None,):
            for point in points:
                yield Cell(experiment, case, dict(zip(spec.vary, point, strict=True)))


def _points(spec: StudySpec) -> Iterator[Sequence[Any]]:
    axes = list(spec.vary.values())
    if spec.design in SAMPLED:
        yield from _sampled(spec, axes)
    elif spec.design == "zip" and axes:
        yield from zip(*(_listed(axis) for axis in axes), strict=True)
    else:
        yield from itertools.product(*(_listed(axis) for axis in axes))


def _listed(axis: Axis) -> Sequence[Any]:
    """Return the values of a list, or of a range in steps; whole numbers of a narrow range come once."""
    if isinstance(axis, RangeSettings):
        steps = axis.steps or 0
        return tuple(dict.fromkeys(_at(axis, i / (steps - 1)) for i in range(steps)))
    return cast(Sequence[Any], axis)


def _sampled(spec: StudySpec, axes: Sequence[Axis]) -> Iterator[Sequence[Any]]:
    import numpy as np  # heavy, and a study is checked without it
    from scipy.stats import qmc

    count, seed = spec.samples or 0, spec.design_seed
    if spec.design == "random":
        unit = np.random.default_rng(seed).random((count, len(axes)))
    elif spec.design == "latin":
        unit = qmc.LatinHypercube(len(axes), rng=seed).random(count)
    else:  # of a power of two, of which the first ones are taken
        unit = qmc.Sobol(len(axes), rng=seed).random_base2((count - 1).bit_length())[:count]
    for row in unit.tolist():
        yield [_at(axis, u) for axis, u in zip(axes, row, strict=True)]


def _at(axis: Axis, u: float) -> Any:
    """Return the value at a place of the unit interval, to six digits: what a table shows is what was run."""
    if isinstance(axis, RangeSettings):
        if axis.scale == "log":
            value = axis.low * (axis.high / axis.low) ** u
        else:
            value = axis.low + u * (axis.high - axis.low)
        return round(value) if axis.whole else float(f"{value:.6g}")
    if isinstance(axis, NormalSettings):
        standard = NormalDist()
        low, high = standard.cdf(-CUT_OFF), standard.cdf(CUT_OFF)
        return float(f"{axis.mean + axis.std * standard.inv_cdf(low + u * (high - low)):.6g}")
    return axis[min(int(u * len(axis)), len(axis) - 1)]
