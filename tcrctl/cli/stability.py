"""``tcrctl stability SPEC``: eigenvalues of the inner iteration and of the closed loop along a simulated run."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import AsJson, Overrides, Quiet, Spec, to_make, unfolded
from tcrctl.cli.progress import kernels_bar, progress_bar
from tcrctl.visible import cell

if TYPE_CHECKING:
    from tcrctl.stability.report import StabilityPoint, StabilityReport

Points = Annotated[
    int, typer.Option("--points", metavar="N", min=1, help="Points, spread evenly over the run.")
]
Every = Annotated[
    int | None, typer.Option("--every", metavar="N", min=1, help="Every N-th control step instead.")
]
Out = Annotated[
    Path | None,
    typer.Option(
        "-o", "--out", metavar="FILE", parser=to_make, help="Write all numbers to a .csv or .npz file."
    ),
]
Figure = Annotated[
    Path | None,
    typer.Option("--figure", metavar="FILE", parser=to_make, help="Draw both curves: .png, .pdf or .svg."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace existing files.")]

TABLES = (".csv", ".npz")
FIGURES = (".png", ".pdf", ".svg")


@dataclass(frozen=True)
class Where:
    """At which steps a loop is linearised."""

    points: Points = 24
    every: Every = None


@unfolded
def stability(
    spec: Spec,
    overrides: Overrides = None,
    where: Where = Where(),
    out: Out = None,
    figure: Figure = None,
    force: Force = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Tell whether the loop of an experiment is stable, by linearising it along a simulated run without noise.

    Two numbers per point: the largest |mu| of the controller's inner iteration (42), which says that it converges
    within a step; and the spectral radius of the whole loop from step to step (plant, estimator, controller), which
    says that deviations fade: below 1 is stable. A point takes some seconds. Exit code 3 if a radius is not below
    1, 4 if the run had to be stopped.

    Examples:
      tcrctl stability fixed_point_rotation
      tcrctl stability helix --set controller.model=static --figure helix.png
      tcrctl stability letter_t --every 100 --out letter_t.csv --json | jq .closed_loop
    """
    _check_file(out, TABLES, force)
    _check_file(figure, FIGURES, force)
    from tcrctl.experiment.spec import load_spec
    from tcrctl.loop.interruption import signals_exit

    with signals_exit():
        loaded = load_spec(spec, overrides or ())
        from tcrctl.experiment.prepare import prepare
        from tcrctl.stability.analysis import analyse

        with kernels_bar(shown=not quiet) as watch:
            experiment = prepare(loaded, notify=_nothing if quiet else _say, watch=watch)
    with progress_bar(loaded.spec.name, shown=not quiet) as progress:
        report = analyse(experiment, points=where.points, every=where.every, progress=progress)
    if out is not None:
        _write(report, out)
    if figure is not None:
        from tcrctl.stability.figure import draw

        draw(report, figure)
    if as_json:
        print(json.dumps(report.as_json()))
    elif not quiet:
        _print(report)
    if report.exit_code:
        print(f"{report.as_json()['status']}: {report.reason}", file=sys.stderr)
        raise typer.Exit(report.exit_code)


def _check_file(path: Path | None, suffixes: tuple[str, ...], force: bool) -> None:
    """Refuse a file that could not be written, before the minutes that the analysis takes."""
    from tcrctl.errors import InputError

    if path is None:
        return
    if path.suffix not in suffixes:
        raise InputError(f"{path}: must end in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    if path.exists() and not force:
        raise InputError(f"{path}: exists already", hint="Give another name, or --force.")


def _write(report: StabilityReport, out: Path) -> None:
    from tcrctl.errors import DeviceError

    columns = report.columns()
    try:
        if out.suffix == ".csv":
            with out.open("w", newline="") as stream:
                writer = csv.writer(stream)
                writer.writerow(map(cell, columns))
                writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
            return
        import numpy as np

        arrays: dict[str, Any] = {**columns, "eigenvalues": np.array([p.eigenvalues for p in report.points])}
        np.savez_compressed(out, **arrays)
    except OSError as error:
        raise DeviceError(f"{out}: cannot be written: {error.strerror or error}") from error


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _nothing(text: str) -> None:
    del text


def _print(report: StabilityReport) -> None:
    from tcrctl.cli.table import print_facts, print_table

    rows = [
        (
            f"{point.t:.2f}",
            f"{point.inner:.2g}",
            f"{point.radius:.5f}",
            f"{report.growth(point):.3g}",
            f"{report.frequency(point):.2f}",
            _remarks(point),
        )
        for point in report.points
    ]
    what = f"{report.robot}, controller {report.controller}, {report.states} states"
    print_facts([(report.spec, what, ""), ("inner iteration", report.inner_iteration or "none", "")])
    print_table(
        ("t [s]", "max |mu| (42)", "spectral radius", "growth per s", "frequency [Hz]", "remarks"),
        rows,
        styles=["" if point.radius < 1.0 else "red" for point in report.points],
        right=range(5),
    )
    worst = report.worst
    if worst is not None:
        text = f"largest spectral radius {worst.radius:.5f} at {worst.t:.2f} s"
        print(f"{text}: {'stable' if report.exit_code == 0 else 'not stable'}")


def _remarks(point: StabilityPoint) -> str:
    """Return what is special about a point."""
    named = {
        "saturated": point.saturated,
        "limits act": point.limited and not point.saturated,
        "not converged": not point.converged,
    }
    return ", ".join(name for name, holds in named.items() if holds)
