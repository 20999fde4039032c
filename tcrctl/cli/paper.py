"""``tcrctl paper``: the paper's experiments against its figures."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.console import console, has_styles
from tcrctl.cli.options import LOGS, AsJson, Quiet, SideBySide, to_make, unfolded
from tcrctl.cli.table import print_facts, print_table

if TYPE_CHECKING:
    from tcrctl.paper.job import Done, Job
    from tcrctl.paper.paper import Report
    from tcrctl.study.plan import PlannedRun
    from tcrctl.study.row import Row

    Told = tuple[Callable[[Job], None], Callable[[Done], None]]

Out = Annotated[
    Path,
    typer.Option(
        "--out",
        metavar="DIR",
        parser=to_make,
        envvar=LOGS,
        help="Where the report's folder is made.",
        show_default=True,
    ),
]
Only = Annotated[
    list[str] | None,
    typer.Option("--only", metavar="ROW", help="Only this row of the table; repeatable. See --rows."),
]
Seeds = Annotated[
    int,
    typer.Option(
        "--seeds",
        metavar="N",
        min=0,
        max=10000,
        help="Rows on N plants as real as a laboratory's too: median, interval, worst. Minutes per plant.",
    ),
]
Names = Annotated[bool, typer.Option("--rows", help="Print the names of the rows and run nothing.")]

_STYLES = {"goal": "green", "met": "green", "missed": "red", "failed": "red", "not run": "yellow"}


@unfolded
def paper(
    out: Out = Path("logs"),
    only: Only = None,
    side: SideBySide = SideBySide(),
    seeds: Seeds = 0,
    rows: Names = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Run every experiment of the paper and compare: paper, bar, goal, measured.

    Runs whose computing time counts have the machine for themselves; the others run side by side. The report
    goes to a new folder DIR/TIME_paper_ID with paper.md, paper.json and all runs. Exit code 3: a bar was missed.
    Ctrl-C stops all runs and keeps what is done. --seeds runs the studies realistic and calibrated, which resume
    where they ended.

    Examples:
      tcrctl paper
      tcrctl paper --seeds 20
      tcrctl paper --only letters --only table2
      tcrctl paper --json --jobs 4 | jq '.rows[] | {name, measured, verdict}'
    """
    from tcrctl.experiment.run_folder import check_writable
    from tcrctl.paper.paper import choose, jobs_of, run_paper

    chosen = choose(only or ())
    if rows:
        print(json.dumps([row.name for row in chosen]) if as_json else "\n".join(row.name for row in chosen))
        return
    check_writable(out)
    with _progress(len(jobs_of(chosen)), quiet=quiet) as (begun, ended):
        told = (lambda run, row: None) if quiet else _say_run
        report = run_paper(
            chosen, out=out, engine=side.engine, seeds=seeds, begun=begun, ended=ended, seed_ended=told
        )
    if report.reason:
        print(f"error: {report.reason}", file=sys.stderr)
    if as_json:
        print(json.dumps(report.as_json()))
    elif not quiet:
        _print_table(report)
    if report.exit_code:
        raise typer.Exit(report.exit_code)


@contextmanager
def _progress(count: int, *, quiet: bool) -> Iterator[Told]:
    """Show what is running and what is done: on a terminal with a bar, elsewhere a line for every job."""
    if quiet:
        yield (lambda job: None), (lambda done: None)
        return
    if not has_styles(sys.stderr):
        yield (lambda job: None), _Counter(count).say
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task, running = bar.add_task("", total=count), dict[str, None]()

        def begun(job: Job) -> None:
            running[job.label] = None
            bar.update(task, description=", ".join(label.split()[0] for label in running))

        def ended(done: Done) -> None:
            running.pop(done.job.label, None)
            bar.update(task, advance=1, description=", ".join(label.split()[0] for label in running))
            bar.console.print(_said(done), markup=False, highlight=False)

        yield begun, ended


class _Counter:
    """Says what is done, one line for every job."""

    def __init__(self, count: int) -> None:
        self._count, self._done = count, 0

    def say(self, done: Done) -> None:
        self._done += 1
        print(f"[{self._done}/{self._count}] {_said(done)}", file=sys.stderr, flush=True)


def _said(done: Done) -> str:
    return f"{done.job.label}: {done.reason or 'done'}, {done.seconds:.0f} s"


def _say_run(run: PlannedRun, row: Row) -> None:
    experiment = run.levels["experiment"]
    print(f"plant {run.seed}, {experiment}: {row.reason or row.status}, {row.seconds:.0f} s", file=sys.stderr)


def _print_table(report: Report) -> None:
    from tcrctl.paper.report import BAD, cells, titles

    lines = sorted(report.lines, key=lambda line: line.verdict not in BAD)
    print_table(titles(lines), cells(lines), styles=[_STYLES.get(line.verdict, "") for line in lines])
    print_facts([("", " ".join(report.notes()), "")])
    print(f"report: {report.folder}")
