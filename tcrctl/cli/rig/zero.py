"""``tcrctl rig zero RIG``: the present positions become zero."""

from __future__ import annotations

from tcrctl.cli.options import AsJson
from tcrctl.cli.rig.action import act
from tcrctl.cli.rig.options import DryRun, Rig, Robot, Yes


def zero(
    rig: Rig, robot: Robot = None, dry_run: DryRun = False, yes: Yes = False, as_json: AsJson = False
) -> None:
    """Make the present positions of all drives zero: tension-zero, at which every cable has its rest tension.

    Bring the cables to their rest tension first, with the manual mode of the PLC; see docs/bench.md. Nothing moves.

    Examples:
      tcrctl rig zero loopback --robot tcr600 --dry-run
      tcrctl rig zero my_bench.yaml
    """
    from tcrctl.commissioning.zero import zero_rig

    act(
        rig,
        robot,
        dry_run,
        yes,
        as_json,
        lambda loaded: f"The present positions of the drives of {loaded.robot} become zero.",
        lambda loaded, names, operation: zero_rig(loaded, names, operation, dry_run=dry_run),
    )
