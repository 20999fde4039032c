"""``tcrctl rig``: work on a bench beside experiments. What moves or writes asks first, and has a dry mode."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import AsJson

if TYPE_CHECKING:
    from tcrctl.plant.rig_file import LoadedRig
    from tcrctl.plant.session import Session
    from tcrctl.rig.finding import Finding

Rig = Annotated[str, typer.Argument(metavar="RIG", help="Shipped rig, or path of a rig file.")]
Robot = Annotated[
    str | None, typer.Option("--robot", metavar="NAME", help="Which robot, if several hang on the rig.")
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Look, but write nothing and move nothing.")]
Yes = Annotated[bool, typer.Option("--yes", help="Agree in advance; nobody is asked.")]


def check(
    rig: Rig,
    robot: Robot = None,
    period_s: Annotated[
        float, typer.Option("--period-s", min=0.001, max=1, help="Control period that shall be possible.")
    ] = 0.05,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only the rig file, no device.")] = False,
    as_json: AsJson = False,
) -> None:
    r"""Find out whether cameras and drives are as the rig file says, and ready; only reads.

    Exit code of the first line that is not ok: 2 the rig file is wrong, 4 not ready to be armed, 5 a device does
    not answer.

    \b
    Examples:
      tcrctl rig check loopback
      tcrctl rig check my_bench.yaml --robot tcr700 --period-s 0.01 --json
    """
    from tcrctl.interruption import signals_exit
    from tcrctl.rig.choice import choose_all
    from tcrctl.rig.finding import Finding, worst

    lines: list[tuple[str, Finding]] = []
    with signals_exit():
        for loaded, description in choose_all(rig, robot):
            lines.append((loaded.robot, Finding("rig file", f"{loaded.path} is valid")))
            if dry_run:
                continue
            from tcrctl.rig.check import check_rig
            from tcrctl.robot.robot import build_robot

            lines += [
                (loaded.robot, found) for found in check_rig(loaded, build_robot(description), period_s)
            ]
    code = worst([finding for _, finding in lines])
    if as_json:
        found = [{"robot": name, **finding.as_json()} for name, finding in lines]
        print(json.dumps({"status": "error" if code else "ok", "findings": found}))
    else:
        _print_findings(lines)
    if code:
        raise typer.Exit(code)


def status(rig: Rig, robot: Robot = None, as_json: AsJson = False) -> None:
    r"""Show where the drives are, what they say, and whether the cameras stream; only reads.

    \b
    Examples:
      tcrctl rig status loopback
      tcrctl rig status my_bench.yaml --json | jq .robots[0].drives.position_mm
    """
    from tcrctl.interruption import signals_exit
    from tcrctl.rig.choice import choose_all
    from tcrctl.rig.status import rig_status

    with signals_exit():
        found = [rig_status(loaded, _cables(description)) for loaded, description in choose_all(rig, robot)]
    code = next((one.exit_code for one in found if one.exit_code), 0)
    if as_json:
        robots = [one.as_json() for one in found]
        print(json.dumps({"status": "error" if code else "ok", "robots": robots}))
    else:
        for one in found:
            _print_rows(one.robot, _flat(one.as_json()))
    for one in found:
        if one.trouble:
            print(f"error: {one.robot}: {one.trouble}", file=sys.stderr)
    if code:
        raise typer.Exit(code)


def calibrate(
    rig: Rig,
    robot: Robot = None,
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, max=600, help="How long to measure.")] = 5.0,
    free: Annotated[
        bool, typer.Option("--free", help="Fit the vertical too; default: that of the levelled cameras.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write the rig file here instead.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the result, change no file.")] = False,
    as_json: AsJson = False,
) -> None:
    r"""Measure the markers on the base ring and write into the rig file where the cameras' frame lies.

    \b
    Examples:
      tcrctl rig calibrate loopback --robot tcr600 --dry-run
      tcrctl rig calibrate my_bench.yaml --seconds 20
      tcrctl rig calibrate loopback --robot tcr600 -o my_bench.yaml
    """
    from tcrctl.errors import InputError
    from tcrctl.interruption import signals_exit
    from tcrctl.rig.calibrate import calibrate_rig, calibration_text, write_calibrated
    from tcrctl.rig.choice import choose
    from tcrctl.robot.robot import build_robot
    from tcrctl.shipped import is_path

    if not (is_path(rig) or out or dry_run):
        raise InputError(f"{rig} is shipped and not changed; give -o FILE or --dry-run")
    with signals_exit():
        loaded, description = choose(rig, robot)
        found = calibrate_rig(loaded, build_robot(description), seconds=seconds, free=free)
        section = calibration_text(found)
        written = None if dry_run else write_calibrated(loaded, section, out)
    numbers = {
        "residual_rms_mm": 1e3 * found.residual_rms_m,
        "residual_max_mm": 1e3 * found.residual_max_m,
        "tilt_deg": found.tilt_deg,
        "scale_error": found.scale_error,
    }
    if as_json:
        where = None if written is None else str(written)
        print(
            json.dumps({"status": "ok", "calibration": found.transform.as_dict(), **numbers, "file": where})
        )
        return
    print(f"calibration: {section}")
    print(", ".join(f"{name} {value:.4g}" for name, value in numbers.items()), file=sys.stderr)
    if written is not None:
        print(f"written to {written}", file=sys.stderr)


def zero(
    rig: Rig, robot: Robot = None, dry_run: DryRun = False, yes: Yes = False, as_json: AsJson = False
) -> None:
    r"""Make the present positions of all drives zero: tension-zero, at which every cable has its rest tension.

    Bring the cables to their rest tension first, with the manual mode of the PLC; see docs/bench.md. Nothing moves.

    \b
    Examples:
      tcrctl rig zero loopback --robot tcr600 --dry-run
      tcrctl rig zero my_bench.yaml
    """
    from tcrctl.rig.zero import zero_rig

    _once(
        rig, robot, dry_run, yes, as_json,
        lambda loaded: f"The present positions of the drives of {loaded.robot} become zero.",
        lambda loaded, names, session: zero_rig(loaded, names, session, dry_run=dry_run),
    )  # fmt: skip


def reset(
    rig: Rig, robot: Robot = None, dry_run: DryRun = False, yes: Yes = False, as_json: AsJson = False
) -> None:
    r"""Clear the latched fault of the PLC, after its cause has been removed. Nothing moves.

    \b
    Examples:
      tcrctl rig reset loopback --robot tcr600 --dry-run
      tcrctl rig reset my_bench.yaml --yes
    """
    from tcrctl.rig.zero import reset_rig

    _once(
        rig, robot, dry_run, yes, as_json,
        lambda loaded: f"The latched fault of the drives of {loaded.robot} is cleared.",
        lambda loaded, names, session: reset_rig(loaded, names, session, dry_run=dry_run),
    )  # fmt: skip


def jog(
    rig: Rig,
    cable: Annotated[
        list[str], typer.Option("--cable", metavar="NAME", help="Cable to move, or all; repeatable.")
    ],
    by_mm: Annotated[float | None, typer.Option("--by-mm", help="How far; positive pulls.")] = None,
    to_mm: Annotated[float | None, typer.Option("--to-mm", help="Where to, from tension-zero.")] = None,
    speed_mm_s: Annotated[float, typer.Option("--speed-mm-s", min=0.01, max=20, help="Largest speed.")] = 5.0,
    robot: Robot = None,
    dry_run: DryRun = False,
    yes: Yes = False,
    as_json: AsJson = False,
) -> None:
    r"""Move cables slowly and smoothly, within the limits of the rig file; Ctrl-C stops.

    \b
    Examples:
      tcrctl rig jog loopback --robot tcr600 --cable c1 --by-mm 2
      tcrctl rig jog my_bench.yaml --cable all --to-mm 0 --speed-mm-s 3
      tcrctl rig jog my_bench.yaml --cable c1 --cable c3 --by-mm -1 --dry-run
    """
    from tcrctl.errors import InputError
    from tcrctl.interruption import Interruption
    from tcrctl.rig.jog import Jog, jog_rig

    if (by_mm is None) == (to_mm is None):
        raise InputError("give either --by-mm or --to-mm")

    def move(loaded: LoadedRig, names: tuple[str, ...], session: Session) -> dict[str, Any]:
        wanted = Jog(
            names if cable == ["all"] else tuple(cable),
            None if by_mm is None else 1e-3 * by_mm,
            None if to_mm is None else 1e-3 * to_mm,
            1e-3 * speed_mm_s,
        )
        with Interruption() as interruption:
            return jog_rig(loaded, names, wanted, session, dry_run=dry_run, check=interruption.check)

    where = f"by {by_mm:g} mm" if by_mm is not None else f"to {to_mm:g} mm"
    _once(
        rig, robot, dry_run, yes, as_json,
        lambda loaded: f"Cables {', '.join(cable)} of {loaded.robot} move {where}.",
        move,
    )  # fmt: skip


def _once(
    rig: str,
    robot: str | None,
    dry_run: bool,
    yes: bool,
    as_json: bool,
    question: Callable[[LoadedRig], str],
    action: Callable[[LoadedRig, tuple[str, ...], Session], dict[str, Any]],
) -> None:
    """Ask, do, show."""
    from tcrctl.cli.consent import ask
    from tcrctl.plant.session import Session
    from tcrctl.rig.choice import choose

    loaded, description = choose(rig, robot)
    if not (dry_run or yes):
        ask(question(loaded))
    result = action(loaded, _cables(description), Session(report=_report, confirmed=True))
    head = {"status": "ok", "robot": loaded.robot, "dry_run": dry_run}
    if as_json:
        print(json.dumps({**head, **result}))
    else:
        _print_rows(f"{loaded.robot}{': dry run, nothing was written' if dry_run else ''}", _flat(result))


def _report(kind: str, level: str, text: str) -> None:
    del kind
    print(text if level == "info" else f"{level}: {text}", file=sys.stderr)


def _cables(description: Any) -> tuple[str, ...]:
    from tcrctl.robot.description import cable_routes

    return tuple(route.name for route in cable_routes(description))


def _flat(value: dict[str, Any], prefix: str = "") -> dict[str, str]:
    rows: dict[str, str] = {}
    for key, item in value.items():
        if isinstance(item, dict):
            rows |= _flat(item, f"{prefix}{key} ")
        else:
            rows[prefix + key] = f"{item:.3f}" if isinstance(item, float) else str(item)
    return rows


def _print_rows(title: str, rows: dict[str, str]) -> None:
    print(title)
    width = max(map(len, rows), default=0)
    for name, text in rows.items():
        print(f"  {name.ljust(width)}  {text}")


def _print_findings(lines: list[tuple[str, Finding]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(show_header=False, box=None)
    for style in ("bold", "", "", ""):
        table.add_column(style=style, overflow="fold")
    for robot, finding in lines:
        verdict = "[green]ok[/green]" if finding.exit_code == 0 else "[red]NOT OK[/red]"
        table.add_row(escape(robot), escape(finding.what), verdict, escape(finding.text))
    Console().print(table)


RIG_VERBS: dict[str, Callable[..., None]] = {
    "check": check,
    "status": status,
    "calibrate": calibrate,
    "zero": zero,
    "jog": jog,
    "reset": reset,
}
