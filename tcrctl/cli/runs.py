"""``tcrctl runs``: what has been run; filtered, sorted, as a table; tagged; removed."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.options import LOGS, AsJson, unfolded

if TYPE_CHECKING:
    from tcrctl.analysis.runs import FoundRun

COLUMNS = ("run_id", "status", "seed", "position_error_mm.max", "orientation_error_deg.max", "tag")


@dataclass(frozen=True)
class Which:
    """Which runs, in which order."""

    where: Annotated[
        str | None,
        typer.Option(
            "--where", metavar="COND", help="E.g. 'controller.kind=ioc and position_error_mm.max<1'."
        ),
    ] = None
    sort: Annotated[
        str | None, typer.Option("--sort", metavar="NAME", help="By this value; -NAME: largest first.")
    ] = None
    last: Annotated[int | None, typer.Option("--last", metavar="N", min=1, help="Only the last N.")] = None


@dataclass(frozen=True)
class Doing:
    """What is done with them beside being listed."""

    tag: Annotated[list[str] | None, typer.Option("--tag", metavar="TAG", help="Tag them; repeatable.")] = (
        None
    )
    untag: Annotated[list[str] | None, typer.Option("--untag", metavar="TAG", help="Remove a tag.")] = None
    remove: Annotated[bool, typer.Option("--rm", help="Say which would be removed; with --yes, do it.")] = (
        False
    )
    yes: Annotated[bool, typer.Option("--yes", help="With --rm: remove them.")] = False


@unfolded
def runs(
    out: Annotated[
        Path, typer.Argument(metavar="[DIR]", envvar=LOGS, help="Where runs go.", show_default=True)
    ] = Path("logs"),
    which: Which = Which(),
    columns: Annotated[
        str | None, typer.Option("--columns", metavar="A,B", help="Values to show, of results or settings.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="text, csv, latex or markdown.")] = "text",
    doing: Doing = Doing(),
    as_json: AsJson = False,
) -> None:
    """List the runs of a folder, oldest first.

    Names are those of run --json, then those of the experiment: position_error_mm.max, controller.kind, seed; and
    tag. --rm without --yes removes nothing.

    Examples:
      tcrctl runs
      tcrctl runs --where 'controller.kind=ioc and position_error_mm.max<1' --sort position_error_mm.max
      tcrctl runs --columns spec,seed,position_error_mm.max,plant.realistic --format markdown
      tcrctl runs --where 'status=aborted' --rm
    """
    from tcrctl.errors import UnknownNameError
    from tcrctl.study.text import FORMATS

    if form not in FORMATS:
        raise UnknownNameError("format", form, FORMATS)
    found = _found(out, which)
    _warn_of_unreadable(out)
    _warn_of_unknown(out, which)
    if doing.remove:
        _remove(found, yes=doing.yes, as_json=as_json)
        return
    for run in found:
        if doing.tag:
            run.tag(doing.tag)
        if doing.untag:
            run.tag(doing.untag, remove=True)
    if doing.tag or doing.untag:
        found = _found(out, which)
    if as_json:
        print(json.dumps({"status": "success", "runs": [_as_json(run) for run in found]}))
    elif not found and form == "text":
        print(f"no run in {out}" + ("" if which.where is None else f" with {which.where}"), file=sys.stderr)
    else:
        _print(found, columns.split(",") if columns else list(COLUMNS), form)


def _warn_of_unreadable(out: Path) -> None:
    from tcrctl.analysis.runs import unreadable

    left_out = [str(folder) for folder in unreadable(out)]
    if left_out:
        said = ", ".join(left_out[:3]) + (f" and {len(left_out) - 3} more" if left_out[3:] else "")
        print(f"warning: left out, summary.json cannot be read: {said}", file=sys.stderr)


def _warn_of_unknown(out: Path, which: Which) -> None:
    """Say which names no run has: a misspelt one finds nothing, and sorts by nothing."""
    from tcrctl.analysis.condition import parse_condition
    from tcrctl.analysis.runs import find_runs

    names = [] if which.where is None else [term.name for term in parse_condition(which.where).terms]
    names += [] if which.sort is None else [which.sort.removeprefix("-")]
    runs = find_runs(out)
    for name in dict.fromkeys(names):
        if runs and all(run.value(name) is None for run in runs):
            print(f"warning: no run in {out} has a value named {name}", file=sys.stderr)


def _found(out: Path, which: Which) -> list[FoundRun]:
    from tcrctl.analysis.condition import parse_condition
    from tcrctl.analysis.runs import find_runs, in_order

    found = find_runs(out, parse_condition(which.where) if which.where is not None else None)
    if which.sort is not None:
        found = in_order(found, which.sort)
    return found if which.last is None else found[-which.last :]


def _remove(found: list[FoundRun], *, yes: bool, as_json: bool) -> None:
    from tcrctl.experiment.headline import count

    size = sum(run.size for run in found)
    for run in found:
        if yes:
            run.remove()
        if not as_json:
            print(run.folder)
    if as_json:
        print(json.dumps({"status": "success", "removed": yes, "runs": [str(run.folder) for run in found]}))
    said = "removed" if yes else "would be removed; --yes removes them"
    print(f"{count(len(found), 'run')}, {size / 1e6:.1f} MB: {said}", file=sys.stderr)


def _as_json(run: FoundRun) -> dict[str, object]:
    return {**run.summary, "folder": str(run.folder), "tags": list(run.tags)}


def _print(found: list[FoundRun], names: list[str], form: str) -> None:
    from tcrctl.study.text import TextTable

    table = TextTable(tuple(names), tuple(tuple(_cell(run, name) for name in names) for run in found))
    if form == "text":
        from tcrctl.cli.table import STATUS_STYLES, print_table

        styles = [STATUS_STYLES.get(str(run.value("status")), "") for run in found]
        print_table(table.head, table.rows, styles=styles)
    else:
        print(table.formatted(form), end="")  # type: ignore[arg-type]  # checked before


def _cell(run: FoundRun, name: str) -> str:
    value = run.value(name.strip())
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    from tcrctl.experiment.headline import number

    return number(value)
