"""What a study will do before it does it: its runs, and how long they may take."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.experiment.headline import count
from tcrctl.regular_file import open_file
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import loads
from tcrctl.study.settings import EXPERIMENT
from tcrctl.study.store import ROWS

#: Runs that are shown of a long list, at either end.
SHOWN: Final = 20


@dataclass(frozen=True, slots=True)
class Estimate:
    """The runs, and the time for those that are missing.

    Attributes:
        runs: All runs.
        missing: How many of them are not done.
        seconds: Wall time with so many processes [s]; None if no run of some experiment has been done yet.
    """

    runs: Sequence[PlannedRun]
    missing: int
    seconds: float | None

    def as_json(self) -> dict[str, Any]:
        """Return the runs, for programs."""
        return {
            "runs": [{"run": run.address, **run.levels, "seed": run.seed} for run in self.runs],
            "missing": self.missing,
            "estimated_s": self.seconds,
        }

    @property
    def titles(self) -> tuple[str, ...]:
        """What stands above the table of runs."""
        return (*(self.runs[0].levels if self.runs else ()), "seed")

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Yield the table of runs, shortened."""
        for i, run in enumerate(self.runs):
            if i < SHOWN or i >= len(self.runs) - SHOWN:
                yield (*run.levels.values(), str(run.seed))
            elif i == SHOWN:
                yield (f"... {len(self.runs) - 2 * SHOWN} more ...", *[""] * (len(self.titles) - 1))

    @property
    def sentence(self) -> str:
        """How many runs there are, and how long they may take."""
        took = "not timed yet" if self.seconds is None else f"about {self.seconds:.0f} s"
        return f"{count(len(self.runs), 'run')}, {self.missing} of them to be done: {took}"


def estimate(runs: Sequence[PlannedRun], folder: Path, jobs: int) -> Estimate:
    """Estimate from the runs that the folder has, also of other versions of the program.

    Args:
        runs: What is planned.
        folder: Of the study.
        jobs: Processes side by side.
    """
    done, times = set[str](), dict[str, list[float]]()
    try:
        with open_file(folder / ROWS) as file:
            lines = file.readlines()
    except OSError:
        lines = []
    for row in map(loads, lines):
        if row is not None:
            done.add(row.address)
            times.setdefault(str(row.result.get("spec", "")), []).append(row.seconds)
    missing = [run for run in runs if run.address not in done]
    names = [run.levels[EXPERIMENT] for run in missing]
    if not all(name in times for name in names):
        return Estimate(runs, len(missing), None)
    return Estimate(runs, len(missing), sum(sum(times[n]) / len(times[n]) for n in names) / jobs)
