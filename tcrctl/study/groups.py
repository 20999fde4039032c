"""Runs that differ in nothing but the seed, or in what is not asked, described together; and pairs of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row
from tcrctl.study.settings import SEED, CompareSettings, StudySpec
from tcrctl.study.statistics import Share, Spread, share, spread
from tcrctl.study.values import large_is_good, value_of

Run = tuple[PlannedRun, Row]
Key = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """Some runs together.

    Attributes:
        levels: What they have in common, factor by factor.
        measures: Every measure; None if the runs do not have it.
        met: How many met all their criteria.
        stopped: How many did not come to their end.
    """

    levels: Mapping[str, str]
    measures: Mapping[str, Spread | None]
    met: Share
    stopped: Share


@dataclass(frozen=True, slots=True)
class Difference:
    """A level of a factor against another one, pair by pair; positive: larger values.

    Attributes:
        levels: What the pairs have in common.
        level: The level.
        measure: What is compared.
        spread: Of the differences: this level minus the one that it is compared with.
        better: In how many pairs it is better.
    """

    levels: Mapping[str, str]
    level: str
    measure: str
    spread: Spread
    better: Share


def done(runs: Sequence[PlannedRun], rows: Sequence[Row | None]) -> list[Run]:
    """Return the runs that are done, with their rows."""
    return [(run, row) for run, row in zip(runs, rows, strict=True) if row is not None]


def groups(spec: StudySpec, runs: Sequence[Run]) -> list[Group]:
    """Describe the groups of a study, in the order of its plan.

    Args:
        spec: Says by what they are grouped, and what is measured.
        runs: Runs that are done.
    """
    factors = spec.factors if spec.group_by is None else spec.group_by
    return [
        Group(
            levels=dict(zip(factors, key, strict=True)),
            measures={name: _spread(name, members) for name in spec.measures},
            met=share(sum(row.status == "success" for _, row in members), len(members)),
            stopped=share(sum(not row.finished for _, row in members), len(members)),
        )
        for key, members in _split(runs, lambda run: tuple(run.levels.get(f, "") for f in factors)).items()
    ]


def _spread(name: str, members: Sequence[Run]) -> Spread | None:
    values = [value for _, row in members if (value := value_of(row, name)) is not None]
    if not any(math.isfinite(value) for value in values) and any(row.finished for _, row in members):
        return None  # those that finished do not have it, and of the others nobody knows
    return spread(values, large_is_good=large_is_good(name)) if values else None


def _split(runs: Sequence[Run], key: Callable[[PlannedRun], Key]) -> dict[Key, list[Run]]:
    found: dict[Key, list[Run]] = {}
    for run, row in runs:
        found.setdefault(key(run), []).append((run, row))
    return found


def differences(spec: StudySpec, runs: Sequence[Run]) -> list[Difference]:
    """Compare the levels of a factor pair by pair.

    Args:
        spec: Says what is compared; nothing if it does not.
        runs: Runs that are done; those without a partner do not count.
    """
    compare = spec.compare
    if compare is None:
        return []
    factors = [f for f in (spec.factors if spec.group_by is None else spec.group_by) if f != compare.factor]
    found = []
    for key, members in _split(runs, lambda run: tuple(run.levels.get(f, "") for f in factors)).items():
        by_level = _split(members, lambda run: (run.levels[compare.factor],))
        baseline = by_level.pop((compare.against,), [])
        for (level,), others in by_level.items():
            for name in spec.measures:
                pairs = _pairs(spec, compare, name, others, baseline)
                if pairs:
                    common = dict(zip(factors, key, strict=True))
                    found.append(_difference(common, level, name, pairs))
    return found


def _pairs(
    spec: StudySpec, compare: CompareSettings, name: str, others: Sequence[Run], baseline: Sequence[Run]
) -> list[tuple[float, float]]:
    by = compare.paired_by
    names = [f for f in (*spec.factors, SEED) if f != compare.factor] if by is None else list(by)
    a, b = (_medians(name, names, side) for side in (others, baseline))
    return [(a[key], b[key]) for key in a if key in b]


def _medians(name: str, factors: Sequence[str], runs: Sequence[Run]) -> dict[Key, float]:
    """Return the median of a measure over all runs that a pair cannot tell apart; mostly there is one."""

    def key(run: PlannedRun) -> Key:
        return tuple(str(run.seed) if f == SEED else run.levels.get(f, "") for f in factors)

    values = {
        key: [value for _, row in members if (value := value_of(row, name)) is not None]
        for key, members in _split(runs, key).items()
    }
    return {key: median(found) for key, found in values.items() if found}


def _difference(
    levels: Mapping[str, str], level: str, name: str, pairs: Sequence[tuple[float, float]]
) -> Difference:
    good = large_is_good(name)
    gaps = [0.0 if a == b else a - b for a, b in pairs]  # two that were stopped are a tie
    better = sum(gap > 0.0 if good else gap < 0.0 for gap in gaps)
    return Difference(levels, level, name, spread(gaps, large_is_good=good), share(better, len(gaps)))
