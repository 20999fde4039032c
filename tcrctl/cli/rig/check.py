"""``tcrctl rig check RIG``: is everything as the rig file says, and ready?"""

from __future__ import annotations

import json
from typing import Annotated

import typer

from tcrctl.cli.options import AsJson
from tcrctl.cli.rig.options import Rig, Robot
from tcrctl.cli.rig.rows import print_findings


def check(
    rig: Rig,
    robot: Robot = None,
    period_s: Annotated[
        float, typer.Option("--period-s", min=0.001, max=1, help="Control period that shall be possible.")
    ] = 0.05,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only the rig file, no device.")] = False,
    as_json: AsJson = False,
) -> None:
    """Find out whether cameras and drives are as the rig file says, and ready; only reads.

    Exit code of the first line that is not ok: 2 the rig file is wrong, 4 not ready to be armed, 5 a device does
    not answer.

    Examples:
      tcrctl rig check loopback
      tcrctl rig check my_bench.yaml --robot tcr700 --period-s 0.01 --json
    """
    from tcrctl.commissioning.choice import choose_all
    from tcrctl.loop.interruption import signals_exit
    from tcrctl.plant.rig.finding import Finding, worst

    lines: list[tuple[str, Finding]] = []
    with signals_exit():
        for loaded, description in choose_all(rig, robot):
            lines.append((loaded.robot, Finding("rig file", f"{loaded.path} is valid")))
            if dry_run:
                continue
            from tcrctl.commissioning.check import check_rig
            from tcrctl.robot.robot import build_robot

            lines += [
                (loaded.robot, found) for found in check_rig(loaded, build_robot(description), period_s)
            ]
    code = worst([finding for _, finding in lines])
    if as_json:
        found = [{"robot": name, **finding.as_json()} for name, finding in lines]
        print(json.dumps({"status": "error" if code else "ok", "findings": found}))
    else:
        print_findings(lines)
    if code:
        raise typer.Exit(code)
