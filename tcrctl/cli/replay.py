"""``tcrctl replay LOG``: does the controller still do what it did?"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson, Overrides, Quiet, to_make, unfolded
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
    Path | None,
    typer.Option(
        "-o", "--out", metavar="FILE", parser=to_make, help="Write the replayed steps to a new log."
    ),
]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        parser=to_make,
        help="Draw recorded and replayed commands; .png, .pdf or .svg.",
    ),
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
    quiet: Quiet = False,
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
    say = _nothing if quiet else _say
    with announced_compilation(say), progress_bar("replay", shown=not quiet) as progress:
        found = run_replay(
            log,
            overrides=overrides or (),
            window=window,
            tolerance=Tolerance(compared.atol, compared.rtol),
            out=out,
            plugins=plugins,
            watch=None if drawing is None else drawing.add,
            announce=lambda changes: _announce(changes, say),
            progress=progress,
        )
    if plot is not None and drawing is not None:
        save(drawing.figure(), plot)
    if as_json:
        print(json.dumps(found.as_json()))
    elif not quiet:
        _print(found)
    if found.exit_code:
        raise typer.Exit(found.exit_code)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _nothing(text: str) -> None:
    del text


def _announce(changes: Sequence[Change], say: Callable[[str], None]) -> None:
    for change in changes:
        say(f"note: {change}")
    if changes:
        say("note: so equal bits are not promised; --rtol 1e-9 compares less strictly")


def _print(found: Replay) -> None:
    from tcrctl.cli.table import print_facts, print_table
    from tcrctl.log.comparison import table

    print_facts(_facts(found))
    heads = ("quantity", "first step", "steps", "largest", "rms")
    print_table(heads, table(found.deviations), title="differences")


def _facts(found: Replay) -> list[tuple[str, str, str]]:
    speed = found.duration_s / found.seconds if found.seconds > 0.0 else 0.0
    style = {"identical": "bold green", "different": "bold red"}.get(found.status, "bold yellow")
    facts = [
        ("log", str(found.log), ""),
        ("status", f"{found.status}{': ' if found.reason else ''}{found.reason}", style),
        ("steps", f"{found.steps} replayed, {found.compared} compared, {found.different} different", ""),
        ("speed", f"{found.duration_s:.2f} s in {found.seconds:.2f} s, {speed:.0f} times real time", ""),
    ]
    facts += [("not compared", text, "") for text in found.not_compared]
    return [*facts, ("replayed log", str(found.out), "")] if found.out is not None else facts
