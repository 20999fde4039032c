"""What changes something on a rig: ask, do, show."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tcrctl.cli.rig.rows import cable_names, flat, print_rows

if TYPE_CHECKING:
    from tcrctl.plant.rig.file import LoadedRig
    from tcrctl.plant.rig.operation import Operation


def act(
    rig: str,
    robot: str | None,
    dry_run: bool,
    yes: bool,
    as_json: bool,
    question: Callable[[LoadedRig], str],
    action: Callable[[LoadedRig, tuple[str, ...], Operation], dict[str, Any]],
) -> None:
    """Ask, do, show.

    Args:
        rig: Shipped rig, or path of a rig file.
        robot: Which robot on it.
        dry_run: The action changes nothing, so nobody is asked.
        yes: Somebody has agreed already.
        as_json: Show the result as one object.
        question: What is going to happen, a sentence.
        action: Does it; takes the rig, the names of the cables and the operation.
    """
    from tcrctl.cli.consent import ask
    from tcrctl.commissioning.choice import choose
    from tcrctl.plant.rig.operation import Operation

    loaded, description = choose(rig, robot)
    if not (dry_run or yes):
        ask(question(loaded))
    result = action(loaded, cable_names(description), Operation(report=_report, confirmed=True))
    head = {"status": "ok", "robot": loaded.robot, "dry_run": dry_run}
    if as_json:
        print(json.dumps({**head, **result}))
    else:
        print_rows(f"{loaded.robot}{': dry run, nothing was written' if dry_run else ''}", flat(result))


def _report(kind: str, level: str, text: str) -> None:
    del kind
    print(text if level == "info" else f"{level}: {text}", file=sys.stderr)
