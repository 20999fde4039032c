"""Rows of the table on plants as real as a laboratory's, over many seeds: studies ``realistic`` and ``calibrated``.

Their rows are kept in their own folders, so that ``tcrctl sweep realistic`` and ``tcrctl paper`` do no run twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.executors.engine import Engine
from tcrctl.paper.job import Run
from tcrctl.paper.row import Row
from tcrctl.study.command_line import told_study
from tcrctl.study.loading import narrowed
from tcrctl.study.plan import PlannedRun, planned
from tcrctl.study.row import Row as StudyRow
from tcrctl.study.settings import EXPERIMENT
from tcrctl.study.statistics import Share, Spread, share, spread
from tcrctl.study.sweep import Done, sweep
from tcrctl.study.text import number

#: Studies, nothing calibrated and each plant after a self-calibration; both have the same plants.
STUDIES: Final = ("realistic", "calibrated")
TITLES: Final = tuple(
    title
    for what in ("on moderate plants", "calibrated")
    for title in (f"{what}, median [95 %]", "worst", "stopped")
)

Runs = Mapping[tuple[str, int], StudyRow]


@dataclass(frozen=True, slots=True)
class OverSeeds:
    """A row over the seeds of many plants.

    Attributes:
        spread: Of its value; plants on which a run was stopped count as infinitely bad.
        stopped: How many those are.
    """

    spread: Spread
    stopped: Share

    def cells(self) -> tuple[str, ...]:
        """Return texts in the order of ``TITLES``."""
        found = self.spread
        interval = "" if math.isnan(found.low) else f" [{number(found.low)}, {number(found.high)}]"
        return (
            number(found.median) + interval,
            number(found.worst),
            f"{self.stopped.count} of {self.stopped.n}",
        )

    def as_json(self) -> dict[str, Any]:
        """Return the object for programs; infinite numbers become null."""
        numbers = {name: getattr(self.spread, name) for name in ("median", "low", "high", "worst")}
        finite = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
        return {"n": self.spread.n, **finite, "stopped": self.stopped.count}


def experiments_of(row: Row) -> tuple[str, ...]:
    """Return the experiments that a row measures as shipped; none if it measures something else, or time."""
    runs = [job for job in row.jobs if isinstance(job, Run) and not job.overrides]
    return tuple(job.experiment for job in runs) if len(runs) == len(row.jobs) else ()


def run_seeds(
    name: str,
    rows: Sequence[Row],
    seeds: int,
    engine: Engine,
    out: Path,
    told: Callable[[PlannedRun, StudyRow], None],
) -> Done | None:
    """Run what a study has not yet of some rows; None if they need nothing of it.

    Args:
        name: Of the study.
        rows: Of the table.
        seeds: How many plants.
        engine: Where.
        out: Where the folder of the study is.
        told: Is told of every run when it is done.

    Raises:
        DeviceError: If the folder cannot be used.
    """
    study = told_study(name, (), {"seeds": f"1..{seeds}"})
    wanted = {name for row in rows for name in experiments_of(row)} & {*study.spec.experiments}
    if not wanted:
        return None
    some = narrowed(study, experiments=sorted(wanted))
    return sweep(some, planned(some), engine=engine, out=out, told=told)


def over_seeds(row: Row, done: Done) -> OverSeeds | None:
    """Measure a row plant by plant; None if it is not measured so, or no plant has all its runs.

    Args:
        row: Of the table.
        done: What the study has.
    """
    names, runs = experiments_of(row), _by_name(done)
    seeds = sorted({seed for _, seed in runs})
    plants = [[runs[name, seed] for name in names] for seed in seeds if all((n, seed) in runs for n in names)]
    if not names or not plants:
        return None
    values = [_value(row, plant) for plant in plants]
    if any(value is None for value in values):
        return None
    known = [value for value in values if value is not None]
    stopped = sum(not all(run.finished for run in plant) for plant in plants)
    return OverSeeds(spread(known, large_is_good=row.at_least), share(stopped, len(plants)))


def _by_name(done: Done) -> Runs:
    pairs = zip(done.runs, done.rows, strict=True)
    return {(run.levels[EXPERIMENT], run.seed): row for run, row in pairs if row is not None}


def _value(row: Row, plant: Sequence[StudyRow]) -> float | None:
    if not all(run.finished for run in plant):
        return -math.inf if row.at_least else math.inf
    value = row.value([run.result for run in plant])
    return None if value is None else float(value)
