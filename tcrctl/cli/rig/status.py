"""``tcrctl rig status RIG``: where the drives are and what they say."""

from __future__ import annotations

import json
import sys

import typer

from tcrctl.cli.options import AsJson
from tcrctl.cli.rig.options import Rig, Robot
from tcrctl.cli.rig.rows import cable_names, flat, print_rows


def status(rig: Rig, robot: Robot = None, as_json: AsJson = False) -> None:
    """Show where the drives are, what they say, and whether the cameras stream; only reads.

    Examples:
      tcrctl rig status loopback
      tcrctl rig status my_bench.yaml --json | jq .robots[0].drives.position_mm
    """
    from tcrctl.commissioning.choice import choose_all
    from tcrctl.commissioning.status import rig_status
    from tcrctl.loop.interruption import signals_exit

    with signals_exit():
        found = [
            rig_status(loaded, cable_names(description)) for loaded, description in choose_all(rig, robot)
        ]
    code = next((one.exit_code for one in found if one.exit_code), 0)
    if as_json:
        robots = [one.as_json() for one in found]
        print(json.dumps({"status": "error" if code else "ok", "robots": robots}))
    else:
        for one in found:
            print_rows(one.robot, flat(one.as_json()))
    for one in found:
        if one.trouble:
            print(f"error: {one.robot}: {one.trouble}", file=sys.stderr)
    if code:
        raise typer.Exit(code)
