"""How far long work is: a bar on a terminal that takes one, a line now and then on one that is plain."""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from tcrctl.cli.console import console, has_styles

if TYPE_CHECKING:
    from tcrctl.study.plan import PlannedRun
    from tcrctl.study.row import Row

#: A plain terminal is told after so long for the first time, and at most after so long again [s].
_FIRST_S: Final = 2.0
_LONGEST_S: Final = 60.0


class SpokenProgress:
    """Says how far work is in lines, ever fewer of them: for terminals on which nothing can be written over."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._begin, self._next = clock, clock(), _FIRST_S

    def say(self, what: str, done: int, total: int | None) -> None:
        """Print what is done and how long the rest takes, if it is time to."""
        elapsed = self._clock() - self._begin
        if not done or elapsed < self._next:
            return
        self._next = elapsed + min(elapsed, _LONGEST_S)
        left = f" of {total}, {elapsed * (total - done) / done:.0f} s left" if total and done else ""
        print(f"{what}: {done}{left}", file=sys.stderr, flush=True)


@contextmanager
def progress_bar(name: str, *, shown: bool = True) -> Iterator[Callable[[int, int | None], None]]:
    """Show a bar on stderr if that is a terminal, lines if it is a plain one; else nothing.

    Args:
        name: What is done.
        shown: False shows nothing in any case.

    Yields:
        Takes how much is done, and of how much if that is known.
    """
    if not (shown and sys.stderr.isatty()):
        yield lambda done, total: None
        return
    if not has_styles(sys.stderr):
        yield functools.partial(SpokenProgress().say, name)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def kernels_bar(*, shown: bool = True) -> Iterator[Callable[[int, int, float | None], None]]:
    """Show how far the compiler is, from the first word of it to the last; on terminals only.

    Yields:
        Takes kernels done and in all, and the seconds that are left, None while that is unknown.
    """
    if not (shown and sys.stderr.isatty()):
        yield lambda done, total, left: None
        return
    name = "compiling kernels"
    if not has_styles(sys.stderr):
        spoken = SpokenProgress()
        yield lambda done, total, left: spoken.say(name, done, total)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[left]}"),
    )
    bar = Progress(*columns, console=console(stderr=True), transient=True)
    task = bar.add_task(name, total=None, left="")

    def told(done: int, total: int, left: float | None) -> None:
        bar.update(task, completed=done, total=total, left="" if left is None else f"{left:.0f} s left")
        if done == total:
            bar.stop()
        elif not bar.live.is_started:
            bar.start()
            bar.console.show_cursor(True)  # Ctrl-C ends the process at once, and would leave it hidden

    try:
        yield told
    finally:
        bar.stop()


@contextmanager
def runs_bar(name: str, total: int, *, quiet: bool) -> Iterator[Callable[[PlannedRun, Row], None]]:
    """Show a bar of the runs of a study on a terminal that takes one; elsewhere a line for every run."""
    count, styled = 0, has_styles(sys.stderr)
    with progress_bar(name, shown=styled and not quiet) as bar:

        def told(run: PlannedRun, row: Row) -> None:
            nonlocal count
            count += 1
            bar(count, total)
            if not quiet and not styled:
                levels = ", ".join(run.levels.values())
                end = f"{row.status}{': ' if row.reason else ''}{row.reason}"
                line = f"[{count}] {levels}, seed {run.seed}: {end}, {row.seconds:.0f} s"
                print(line, file=sys.stderr, flush=True)

        yield told
