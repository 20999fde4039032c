"""``tcrctl replay LOG``: does the controller still do what it did?"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.console import console, escaped
from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson, Overrides, unfolded
from tcrctl.cli.progress import progress_bar

if TYPE_CHECKING:
    from tcrctl.replay.environment import Change
    from tcrctl.replay.result import Replay

First = Annotated[
    int | None, typer.Option("--from", metavar="K", min=0, help="First step that is compared; default: 0.")
]
Last = Annotated[
    int | None,
    typer.Option("--to", metavar="K", min=0, help="Last step that is compared; default: the last."),
]
Atol = Annotated[
    float, typer.Option("--atol", min=0.0, help="Absolute difference that counts as none, in SI units.")
]
Rtol = Annotated[float, typer.Option("--rtol", min=0.0, help="Relative difference that counts as none.")]
Out = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write the replayed steps to a new log.")
]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Draw recorded and replayed commands; .png, .pdf or .svg."),
]


Plugins = Annotated[
    Path | None,
    typer.Option(
        "--plugins",
        metavar="FOLDER",
        help="Holds the files of kinds that are not built in; they are run, so read them first.",
    ),
]


@dataclass(frozen=True)
class Compared:
    """Which steps are compared, and how strictly."""

    first: First = None
    last: Last = None
    atol: Atol = 0.0
    rtol: Rtol = 0.0


@unfolded
def replay(
    log: LogFile,
    overrides: Overrides = None,
    compared: Compared = Compared(),
    out: Out = None,
    plot: Plot = None,
    plugins: Plugins = None,
    as_json: AsJson = False,
) -> None:
    """Feed a log to its own controller, and compare commands, estimates and tensions bit for bit.

    Robot, estimator and controller are rebuilt from the files attached to the
    log; measurements, references and applied commands are the recorded ones.

    With --set, settings of controller, estimator or safety change: what would
    it have done with the same input? The robot does not answer to it; for
    that, run the experiment again.

    Code that a log carries, or names, is not run. If its controller came from
    a file or module, --plugins says where you have it.

    Exit code 0 if every step is identical, 3 if one is not, or if steps in
    between are missing.

    Examples:
      tcrctl replay logs/20261122-061500Z_letter_t_7f3a/log.mcap
      tcrctl replay log.mcap --set controller.prediction.horizon_s=1.0 --plot longer.png
      tcrctl replay log.mcap --from 100 --to 200 --rtol 1e-9 --json
    """
    from tcrctl.experiment.compilation import announced_compilation
    from tcrctl.replay.figure import WhatIf, check_format, save
    from tcrctl.replay.replay import replay as run_replay
    from tcrctl.replay.result import Tolerance, checked_window

    window, drawing = checked_window(compared.first, compared.last), None
    if plot is not None:
        check_format(plot)
        drawing = WhatIf()
    with announced_compilation(_say), progress_bar("replay") as progress:
        found = run_replay(
            log,
            overrides=overrides or (),
            window=window,
            tolerance=Tolerance(compared.atol, compared.rtol),
            out=out,
            plugins=plugins,
            watch=None if drawing is None else drawing.add,
            announce=_announce,
            progress=progress,
        )
    if plot is not None and drawing is not None:
        save(drawing.figure(), plot)
    if as_json:
        print(json.dumps(found.as_json()))
    else:
        _print(found)
    if found.exit_code:
        raise typer.Exit(found.exit_code)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _announce(changes: Sequence[Change]) -> None:
    for change in changes:
        print(f"note: {change}", file=sys.stderr)
    if changes:
        print("note: so equal bits are not promised; --rtol 1e-9 compares less strictly", file=sys.stderr)


def _print(found: Replay) -> None:
    from rich.table import Table

    from tcrctl.log.comparison import table

    screen = console()
    facts = Table(show_header=False, box=None)
    facts.add_column(style="bold", no_wrap=True)
    facts.add_column(overflow="fold")
    for name, text in _facts(found):
        facts.add_row(name, escaped(text))
    screen.print(facts)
    if found.deviations:
        rows = Table(
            "quantity",
            "first step",
            "steps",
            "largest",
            "rms",
            title="differences",
            title_justify="left",
            box=None,
        )
        for row in table(found.deviations):
            rows.add_row(*(escaped(cell) for cell in row))
        screen.print(rows)


def _facts(found: Replay) -> list[tuple[str, str]]:
    speed = found.duration_s / found.seconds if found.seconds > 0.0 else 0.0
    facts = [
        ("log", str(found.log)),
        ("status", f"{found.status}{': ' if found.reason else ''}{found.reason}"),
        ("steps", f"{found.steps} replayed, {found.compared} compared, {found.different} different"),
        ("speed", f"{found.duration_s:.2f} s in {found.seconds:.2f} s, {speed:.0f} times real time"),
    ]
    facts += [("not compared", text) for text in found.not_compared]
    return [*facts, ("replayed log", str(found.out))] if found.out is not None else facts
