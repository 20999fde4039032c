"""The bar that long work shows on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tcrctl.cli.console import console


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
