"""What a sample of runs says, with intervals: medians by the bootstrap, shares by Wilson's formula.

Runs that did not come to their end are infinitely bad, so no quantile hides them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from tcrctl.signals import Array

#: Samples of the bootstrap, and their seed: the same table every time.
SAMPLES: Final = 2000
BOOTSTRAP_SEED: Final = 0
CONFIDENCE: Final = 0.95
#: Numbers that are drawn at a time, so that large samples fit into memory.
MOST_AT_ONCE: Final = 1_000_000
#: Fewer values than this have no interval.
FEWEST: Final = 3


@dataclass(frozen=True, slots=True)
class Spread:
    """A measure over some runs, in its unit.

    Attributes:
        n: How many runs.
        median: Median; infinite if half of the runs did not come to their end.
        low: Lower end of the 95 % interval of the median; NaN for fewer than three runs.
        high: Its upper end.
        lower_quartile: A quarter of the runs is below.
        upper_quartile: A quarter of the runs is above.
        worst: The worst value.
    """

    n: int
    median: float
    low: float
    high: float
    lower_quartile: float
    upper_quartile: float
    worst: float


@dataclass(frozen=True, slots=True)
class Share:
    """How many of how many.

    Attributes:
        count: How many.
        n: Of how many.
        low: Lower end of the 95 % interval of the share (Wilson).
        high: Its upper end.
    """

    count: int
    n: int
    low: float
    high: float


def spread(values: Sequence[float], *, large_is_good: bool) -> Spread:
    """Describe a sample.

    Args:
        values: At least one; infinities are values.
        large_is_good: Whether the smallest value is the worst.
    """
    sample = np.sort(np.asarray(values, dtype=float))
    low, high = median_interval(sample)
    quartiles = np.quantile(
        sample, (0.25, 0.75), method="inverted_cdf"
    )  # never between a number and infinity
    return Spread(
        n=sample.size,
        median=float(np.median(sample)),
        low=low,
        high=high,
        lower_quartile=float(quartiles[0]),
        upper_quartile=float(quartiles[1]),
        worst=float(sample[0] if large_is_good else sample[-1]),
    )


def median_interval(sample: Array) -> tuple[float, float]:
    """Return the 95 % percentile bootstrap interval of the median of a sample (n,); NaN if it is too small."""
    if sample.size < FEWEST:
        return float("nan"), float("nan")
    random, size = np.random.default_rng(BOOTSTRAP_SEED), sample.size
    block = max(1, min(SAMPLES, MOST_AT_ONCE // size))
    sizes = [min(block, SAMPLES - begin) for begin in range(0, SAMPLES, block)]
    medians = np.sort(np.concatenate([np.median(random.choice(sample, (k, size)), axis=1) for k in sizes]))
    out = 0.5 * (1.0 - CONFIDENCE)
    return float(medians[int(out * SAMPLES)]), float(medians[int((1.0 - out) * SAMPLES) - 1])


def share(count: int, n: int) -> Share:
    """Describe a share."""
    test = stats.binomtest(count, n)  # type: ignore[attr-defined]  # it has no stubs
    interval = test.proportion_ci(CONFIDENCE, method="wilson")
    return Share(count, n, float(interval.low), float(interval.high))
