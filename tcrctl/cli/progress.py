"""The bar that long work shows on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tcrctl.cli.console import console

if TYPE_CHECKING:
    from tcrctl.study.plan import PlannedRun
    from tcrctl.study.row import Row


@contextmanager
def progress_bar(name: str, *, shown: bool = True) -> Iterator[Callable[[int, int | None], None]]:
    """Show a bar on stderr if that is a terminal; else nothing.

    Args:
        name: What is done.
        shown: False shows nothing in any case.

    Yields:
        Takes how much is done, and of how much if that is known.
    """
    if not (shown and sys.stderr.isatty()):
        yield lambda done, total: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def runs_bar(name: str, total: int, *, quiet: bool) -> Iterator[Callable[[PlannedRun, Row], None]]:
    """Show a bar of the runs of a study on a terminal; elsewhere a line for every run."""
    count = 0
    with progress_bar(name, shown=not quiet) as bar:

        def told(run: PlannedRun, row: Row) -> None:
            nonlocal count
            count += 1
            bar(count, total)
            if not quiet and not sys.stderr.isatty():
                levels = ", ".join(run.levels.values())
                end = f"{row.status}{': ' if row.reason else ''}{row.reason}"
                line = f"[{count}] {levels}, seed {run.seed}: {end}, {row.seconds:.0f} s"
                print(line, file=sys.stderr, flush=True)

        yield told
