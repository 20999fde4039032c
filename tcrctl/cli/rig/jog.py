"""``tcrctl rig jog RIG``: move single cables slowly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import AsJson, unfolded
from tcrctl.cli.rig.action import act
from tcrctl.cli.rig.options import DryRun, Rig, Robot, Yes

if TYPE_CHECKING:
    from tcrctl.plant.rig.file import LoadedRig
    from tcrctl.plant.rig.operation import Operation


@dataclass(frozen=True)
class Wanted:
    """Which cables move, how far and how fast."""

    cable: Annotated[
        list[str], typer.Option("--cable", metavar="NAME", help="Cable to move, or all; repeatable.")
    ]
    by_mm: Annotated[float | None, typer.Option("--by-mm", help="How far; positive pulls.")] = None
    to_mm: Annotated[float | None, typer.Option("--to-mm", help="Where to, from tension-zero.")] = None
    speed_mm_s: Annotated[float, typer.Option("--speed-mm-s", min=0.01, max=20, help="Largest speed.")] = 5.0


@unfolded
def jog(
    rig: Rig,
    wanted: Wanted,
    robot: Robot = None,
    dry_run: DryRun = False,
    yes: Yes = False,
    as_json: AsJson = False,
) -> None:
    """Move cables slowly and smoothly, within the limits of the rig file; Ctrl-C stops.

    Examples:
      tcrctl rig jog loopback --robot tcr600 --cable c1 --by-mm 2
      tcrctl rig jog my_bench.yaml --cable all --to-mm 0 --speed-mm-s 3
      tcrctl rig jog my_bench.yaml --cable c1 --cable c3 --by-mm -1 --dry-run
    """
    from tcrctl.commissioning.jog import Jog, jog_rig
    from tcrctl.errors import InputError
    from tcrctl.loop.interruption import Interruption

    cable = wanted.cable
    by_mm = wanted.by_mm
    to_mm = wanted.to_mm
    if (by_mm is None) == (to_mm is None):
        raise InputError("give either --by-mm or --to-mm")

    def move(loaded: LoadedRig, names: tuple[str, ...], operation: Operation) -> dict[str, Any]:
        motion = Jog(
            names if cable == ["all"] else tuple(cable),
            None if by_mm is None else 1e-3 * by_mm,
            None if to_mm is None else 1e-3 * to_mm,
            1e-3 * wanted.speed_mm_s,
        )
        with Interruption() as interruption:
            return jog_rig(loaded, names, motion, operation, dry_run=dry_run, check=interruption.check)

    where = f"by {by_mm:g} mm" if by_mm is not None else f"to {to_mm:g} mm"
    act(
        rig,
        robot,
        dry_run,
        yes,
        as_json,
        lambda loaded: f"Cables {', '.join(cable)} of {loaded.robot} move {where}.",
        move,
    )
