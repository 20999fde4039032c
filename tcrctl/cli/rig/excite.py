"""``tcrctl rig excite RIG``: the excitation on a bench, from whose log it is identified."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.options import AsJson
from tcrctl.cli.rig.options import Rig, Robot
from tcrctl.cli.run import DryRun, Out, Yes, run


def excite(
    rig: Rig,
    robot: Robot = None,
    spec: Annotated[
        str, typer.Option("--spec", metavar="SPEC", help="Another excitation, e.g. of identify --design.")
    ] = "excitation",
    out: Out = Path("logs"),
    dry_run: DryRun = False,
    yes: Yes = False,
    as_json: AsJson = False,
) -> None:
    """Pull every cable and go through poses, open loop, to calibrate a robot and its cameras from the log.

    It is ``tcrctl run excitation`` with the rig in the place of the simulated plant.

    Examples:
      tcrctl rig excite loopback --robot tcr600 --dry-run
      tcrctl rig excite my_bench.yaml && tcrctl identify --calibrate logs/TIME_excitation_ID
    """
    overrides = ["plant.kind=rig", f"plant.rig={rig}", *([] if robot is None else [f"robot={robot}"])]
    run(spec=spec, overrides=overrides, dry_run=dry_run, out=out, yes=yes, as_json=as_json)
