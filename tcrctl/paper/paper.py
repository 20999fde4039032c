"""Run the table and write the report."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.errors import DeviceError, RunInterruptedError, UnknownNameError
from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import Crash, outcomes
from tcrctl.experiment.headline import count
from tcrctl.experiment.provenance import versions
from tcrctl.experiment.run_folder import RunFolder, make_run_folder
from tcrctl.loop.interruption import Interruption
from tcrctl.paper.job import Done, Job, do, warm_up
from tcrctl.paper.over_seeds import STUDIES, over_seeds, run_seeds
from tcrctl.paper.report import BAD, Line, make_line, markdown
from tcrctl.paper.row import Row
from tcrctl.paper.table import ROWS
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row as StudyRow

MARKDOWN: Final = "paper.md"
JSON: Final = "paper.json"
#: Load per core from which on measured milliseconds are not to be trusted; the bars of time are ratios.
BUSY: Final = 0.5
#: No job of the table takes nearly as long [s].
TIME_LIMIT_S: Final = 900.0
#: Runs whose time counts have a worker process of this computer, and the machine, for themselves.
ALONE: Final = Engine(jobs=1)


@dataclass(frozen=True, slots=True)
class Report:
    """The table as far as it got.

    Attributes:
        folder: Where report and runs lie.
        lines: One per row.
        workers: Processes that ran side by side.
        seconds: Wall time [s].
        load: Processes that wanted to run on this machine just before, mean of a minute; times suffer if there
            are nearly as many as cores.
        interruption: What ended it early, if something did.
        seeds: Plants as real as a laboratory's that it was run on too.
    """

    folder: Path
    lines: tuple[Line, ...]
    workers: int
    seconds: float
    load: float
    interruption: RunInterruptedError | DeviceError | None
    seeds: int = 0

    @property
    def missed(self) -> list[str]:
        """Names of the rows that miss their bar or could not be measured."""
        return [line.row.name for line in self.lines if line.verdict in BAD]

    @property
    def exit_code(self) -> int:
        """Of :mod:`tcrctl.errors`: 3 if a bar is missed."""
        if self.interruption is not None:
            return self.interruption.exit_code
        return 3 if self.missed else 0

    @property
    def reason(self) -> str:
        """Why it is not a success; empty if it is one."""
        if self.interruption is not None:
            return str(self.interruption)
        return f"missed: {', '.join(self.missed)}" if self.missed else ""

    def notes(self) -> list[str]:
        """Return sentences that belong below the table."""
        verdicts = [line.verdict for line in self.lines if line.row.must is not None]
        met, goals, idle = (
            sum(v in wanted for v in verdicts) for wanted in (("met", "goal"), ("goal",), ("not run",))
        )
        left = f", {idle} not run" if idle else ""
        notes = [
            f"{met} of {len(verdicts)} bars met{left}; {goals} goals met too."
            if verdicts
            else "No bars here.",
            f"Made by `{self.command}` in {self.seconds:.0f} s with {count(self.workers, 'process')}.",
        ]
        if self.load > BUSY * self.cores:
            busy = f"load {self.load:.1f} on {self.cores} cores"
            notes.append(f"The machine was busy with other work before ({busy}): milliseconds are too many.")
        return notes

    @property
    def command(self) -> str:
        """What a person would type."""
        return f"tcrctl paper --seeds {self.seeds}" if self.seeds else "tcrctl paper"

    @property
    def cores(self) -> int:
        """Cores of this machine."""
        return os.cpu_count() or 1

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``tcrctl paper --json``."""
        status = "aborted" if self.interruption else "failed" if self.missed else "success"
        return {
            "status": status,
            "reason": self.reason,
            "rows": [line.as_json() for line in self.lines],
            "goals_met": [line.row.name for line in self.lines if line.verdict == "goal"],
            "seconds": self.seconds,
            "processes": self.workers,
            "cores": self.cores,
            "load_before": self.load,
            "folder": str(self.folder),
            "versions": versions(),
        }


def choose(names: Sequence[str]) -> tuple[Row, ...]:
    """Return the rows of some names, all if there are none.

    Raises:
        UnknownNameError: If there is no row of a name.
    """
    known = [row.name for row in ROWS]
    for name in names:
        if name not in known:
            raise UnknownNameError("row", name, known)
    return tuple(row for row in ROWS if not names or row.name in names)


def jobs_of(rows: Sequence[Row]) -> tuple[Job, ...]:
    """Return what has to be run for some rows, each job once."""
    return tuple(dict.fromkeys(job for row in rows for job in row.jobs))


def run_paper(
    rows: Sequence[Row],
    *,
    out: Path,
    engine: Engine,
    seeds: int = 0,
    begun: Callable[[Job], None],
    ended: Callable[[Done], None],
    seed_ended: Callable[[PlannedRun, StudyRow], None] = lambda run, row: None,
) -> Report:
    """Run the jobs of some rows and write the report; also what there is of it when a signal stops it.

    Args:
        rows: What to measure.
        out: Where the report's folder is made.
        engine: Where jobs run side by side.
        seeds: On how many plants as real as a laboratory's rows are run too.
        begun: Is told when a job begins.
        ended: Is told what became of it.
        seed_ended: Is told of every run on such a plant when it is done.

    Raises:
        DeviceError: If the folder cannot be made or written to.
    """
    folder = make_run_folder(out, "paper")
    done = dict[Job, Done]()
    begin = time.monotonic()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0

    interruption: RunInterruptedError | DeviceError | None = None
    try:
        for item in run_jobs(jobs_of(rows), folder.path, engine, begun, warm_up):
            done[item.job] = item
            ended(item)
    except RunInterruptedError as error:
        interruption = error
    lines = tuple(make_line(row, done) for row in rows)
    for study in STUDIES if seeds else ():
        if interruption is None and (plants := run_seeds(study, rows, seeds, engine, out, seed_ended)):
            lines = tuple(line.over(study, over_seeds(line.row, plants)) for line in lines)
            interruption = plants.interruption
    report = Report(folder.path, lines, engine.jobs, time.monotonic() - begin, load, interruption, seeds)
    _write(report, folder)
    return report


def run_jobs(
    jobs: Sequence[Job],
    folder: Path,
    engine: Engine,
    begun: Callable[[Job], None],
    warm: Callable[[], object] | None = None,
) -> Iterator[Done]:
    """Run jobs, last those that need the machine for themselves, one by one; yield what became of each.

    Args:
        jobs: What to run.
        folder: Where the jobs write.
        engine: Where the others run.
        begun: Is told when a job begins.
        warm: Is called before them, where they run side by side.

    Raises:
        RunInterruptedError: If a signal came; running jobs were told to stop, and did or were killed.
    """
    alone = [(job, folder) for job in jobs if job.alone]
    rest = [(job, folder) for job in jobs if not job.alone]
    with Interruption() as interruption:
        for some, where in ((rest, engine), (alone, ALONE)):
            for (job, _), outcome in outcomes(
                where,
                do,
                some,
                check=interruption.check,
                begun=lambda order: begun(order[0]),
                deadline_s=TIME_LIMIT_S,
                warm=None if where is ALONE else warm,
            ):
                if isinstance(outcome, Crash):
                    outcome = Done(job, {}, outcome.reason, TIME_LIMIT_S, 1)
                yield outcome


def _write(report: Report, folder: RunFolder) -> None:
    folder.write(MARKDOWN, markdown(report.lines, report.notes()).encode())
    folder.write(JSON, (json.dumps(report.as_json(), indent=2) + "\n").encode())
