"""``tcrctl diff A B``: what is different between two runs?"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.log_file import log_path
from tcrctl.cli.options import AsJson, Quiet

if TYPE_CHECKING:
    from tcrctl.analysis.diff import Entry, LogDiff


def diff(
    a: Annotated[Path, typer.Argument(metavar="A", help="Log of a run.", parser=log_path)],
    b: Annotated[Path, typer.Argument(metavar="B", help="Log of another run.", parser=log_path)],
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Compare two logs: settings, provenance, and every quantity of every step.

    Exit code 0 if settings and steps are the same, bit for bit, else 3. Run id,
    machine and versions are shown and do not count; durations are not compared.

    Examples:
      tcrctl diff before/log.mcap after/log.mcap
      tcrctl diff a.mcap b.mcap --json | jq '.settings[].key'
    """
    from tcrctl.analysis.diff import diff as compare

    found = compare(a, b)
    if as_json:
        print(json.dumps(found.as_json()))
    elif not quiet:
        _print(found)
    if not found.same:
        raise typer.Exit(3)


def _print(found: LogDiff) -> None:
    from tcrctl.experiment.headline import count
    from tcrctl.log.comparison import table

    only_a, only_b, both = found.steps
    _table("settings", ("key", "A", "B"), _entries(found.settings))
    _table("provenance", ("name", "A", "B"), _entries(found.provenance))
    _table("steps", ("quantity", "first step", "steps", "largest", "rms"), table(found.deviations))
    rest = f"; {only_a} only in A, {only_b} only in B" if only_a or only_b else ""
    print(f"{'same' if found.same else 'different'}: {count(both, 'step')} in both{rest}")


def _entries(entries: Iterable[Entry]) -> Iterator[tuple[str, ...]]:
    for entry in entries:
        yield entry.key, _text(entry.a), _text(entry.b)


def _text(value: Any) -> str:
    return "-" if value is None else str(value)


def _table(title: str, head: Sequence[str], rows: Iterable[tuple[str, ...]]) -> None:
    from tcrctl.cli.table import print_table

    print_table(head, rows, title=title)
