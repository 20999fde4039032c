"""``tcrctl plot LOG...``: figures of one run, or of several to compare."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.options import AsJson, to_make, unfolded

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOG...", help="Logs of runs, or the folders of the runs.")
]
Figures = Annotated[
    list[str] | None,
    typer.Option("--figure", "-f", metavar="NAME", help="Which figure; repeatable. Default: all."),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        parser=to_make,
        help="Where files are made; default: plots beside the log, ./plots for several logs.",
    ),
]
Format = Annotated[str, typer.Option("--format", metavar="png|pdf|svg", help="File format.")]
Labels = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="TEXT", help="Name in legends, one per log in the same order."),
]
Begin = Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="First time shown.")]
End = Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="Last time shown.")]


@dataclass(frozen=True)
class Shown:
    """What of the runs is shown, and what they are called."""

    labels: Labels = None
    begin: Begin = None
    end: End = None


@dataclass(frozen=True)
class Files:
    """Where the figures go."""

    out: Out = None
    file_format: Format = "png"
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False


@dataclass(frozen=True)
class Looks:
    """How large the figures are and what they are written in."""

    width_mm: Annotated[
        float, typer.Option("--width-mm", metavar="MM", help="Width of a figure: 88 for one column.")
    ] = 177.8
    font: Annotated[str, typer.Option("--font", metavar="NAME", help="Family of the text.")] = "DejaVu Sans"
    style: Annotated[
        str, typer.Option("--style", metavar="paper|talk", help="Text and lines for a page or a room.")
    ] = "paper"


@unfolded
def plot(
    logs: Logs,
    figures: Figures = None,
    files: Files = Files(),
    shown: Shown = Shown(),
    looks: Looks = Looks(),
    as_json: AsJson = False,
) -> None:
    """Draw figures of a run; several logs are overlaid.

    Figures: overview, path, position, orientation, normal, error, drives, speeds, tensions, timing, task,
    innovation, latency, comparison. By default those that show something: no comparison of one run, no task
    where there is none.

    Examples:
      tcrctl plot logs/*_letter_t_*/log.mcap
      tcrctl plot log.mcap --figure path --figure error --format pdf --out figures
      tcrctl plot static/log.mcap dynamic/log.mcap --label static --label dynamic
      tcrctl plot log.mcap -f tensions --from 10 --to 20
      tcrctl plot log.mcap -f error --format pdf --width-mm 88 --font "Liberation Serif"
    """
    from tcrctl.analysis.history import read_histories
    from tcrctl.experiment.headline import count
    from tcrctl.plots import FIGURES, check_names, save_figures, worth_drawing
    from tcrctl.plots.look import checked_look

    check_names(figures or FIGURES, files.file_format)
    look = checked_look(looks.width_mm, looks.font, looks.style)
    histories = read_histories(logs, labels=shown.labels or (), begin=shown.begin, end=shown.end)
    names = list(dict.fromkeys(figures or worth_drawing(histories)))
    out = files.out or (histories[0].log.path.parent if len(logs) == 1 else Path()) / "plots"
    written = []
    for path in save_figures(histories, names, out, files.file_format, force=files.force, look=look):
        written.append(str(path))
        if not as_json:
            print(path, flush=True)
    if as_json:
        print(json.dumps({"status": "ok", "files": written}))
    else:
        print(count(len(written), "figure"), file=sys.stderr)
