"""``tcrctl rig calibrate RIG``: where the cameras' frame lies."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.options import AsJson, to_make
from tcrctl.cli.rig.options import Rig, Robot


def calibrate(
    rig: Rig,
    robot: Robot = None,
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, max=600, help="How long to measure.")] = 5.0,
    free: Annotated[
        bool, typer.Option("--free", help="Fit the vertical too; default: that of the levelled cameras.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", parser=to_make, help="Write the rig file here instead."),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the result, change no file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the markers on the base ring and write into the rig file where the cameras' frame lies.

    Examples:
      tcrctl rig calibrate loopback --robot tcr600 --dry-run
      tcrctl rig calibrate my_bench.yaml --seconds 20
      tcrctl rig calibrate loopback --robot tcr600 -o my_bench.yaml
    """
    from tcrctl.commissioning.calibrate import calibrate_rig, calibration_text, write_calibrated
    from tcrctl.commissioning.choice import choose
    from tcrctl.config.shipped import is_path
    from tcrctl.errors import InputError
    from tcrctl.loop.interruption import signals_exit
    from tcrctl.robot.robot import build_robot

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
