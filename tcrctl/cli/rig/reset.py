"""``tcrctl rig reset RIG``: clear a latched fault."""

from __future__ import annotations

from tcrctl.cli.options import AsJson
from tcrctl.cli.rig.action import act
from tcrctl.cli.rig.options import DryRun, Rig, Robot, Yes


def reset(
    rig: Rig, robot: Robot = None, dry_run: DryRun = False, yes: Yes = False, as_json: AsJson = False
) -> None:
    """Clear the latched fault of the PLC, after its cause has been removed. Nothing moves.

    Examples:
      tcrctl rig reset loopback --robot tcr600 --dry-run
      tcrctl rig reset my_bench.yaml --yes
    """
    from tcrctl.commissioning.zero import reset_rig

    act(
        rig,
        robot,
        dry_run,
        yes,
        as_json,
        lambda loaded: f"The latched fault of the drives of {loaded.robot} is cleared.",
        lambda loaded, names, operation: reset_rig(loaded, names, operation, dry_run=dry_run),
    )
