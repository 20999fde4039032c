"""``tcrctl workspace ROBOT``: where its end can be."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.layout import message, width
from tcrctl.cli.options import LOGS, AsJson, Quiet, SideBySide, to_make, unfolded

if TYPE_CHECKING:
    from tcrctl.workspace.workspace import Workspace


@dataclass(frozen=True)
class Reach:
    """How far is looked."""

    rays: Annotated[int, typer.Option("--rays", metavar="N", min=1, max=1_000_000, help="Directions.")] = 512
    spacing: Annotated[
        float,
        typer.Option("--spacing-mm", min=0.1, max=50.0, help="Change of the fastest drive between points."),
    ] = 4.0
    floor: Annotated[float, typer.Option("--floor-n", min=0.0, help="Lowest tension of a taut cable.")] = 0.5
    ceiling: Annotated[
        float | None,
        typer.Option("--ceiling-n", min=0.0, help="Highest tension; default: the robot's limit."),
    ] = None


@unfolded
def workspace(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Shipped robot, or path of a YAML file.")],
    reach: Reach = Reach(),
    side: SideBySide = SideBySide(),
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", parser=to_make, envvar=LOGS, help="Where the folder is made."),
    ] = Path("logs"),
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Find end positions and tilts that a robot reaches at rest, with taut cables and within its strokes.

    From rest, rays go out in all directions of the space of drive lengths, equilibrium by equilibrium, until a
    stroke, a tension or the end of stability stops them. The result goes to a new folder: workspace.csv,
    workspace.png, workspace.ply for 3-D viewers, workspace.json.

    Examples:
      tcrctl workspace tcr700
      tcrctl workspace my_robot.yaml --rays 4096 --floor-n 1 --json | jq .radius_mm
    """
    from tcrctl.loop.interruption import signals_exit

    with signals_exit():
        from tcrctl.cli.progress import progress_bar
        from tcrctl.experiment.run_folder import check_writable, make_run_folder
        from tcrctl.robot.description import load_robot
        from tcrctl.workspace.ray import Limits
        from tcrctl.workspace.workspace import explore

        check_writable(out)
        description = load_robot(robot)
        ceiling = description.tension_limit_n if reach.ceiling is None else reach.ceiling
        limits = Limits(reach.floor, ceiling, 1e-3 * reach.spacing)
    with progress_bar(description.name, shown=not quiet) as progress:
        found = explore(description, reach.rays, limits, side.engine, progress)
    folder = make_run_folder(out, f"{description.name}_workspace").path
    _write(found, folder)
    if as_json:
        print(json.dumps({"status": "success", "reason": "", **found.as_json(), "folder": str(folder)}))
    elif not quiet:
        _print(found, folder)


def _write(found: Workspace, folder: Path) -> None:
    from tcrctl.workspace.figure import draw
    from tcrctl.workspace.files import point_cloud, table

    (folder / "workspace.csv").write_text(table(found), encoding="utf-8")
    (folder / "workspace.ply").write_text(point_cloud(found), encoding="utf-8")
    (folder / "workspace.json").write_text(json.dumps(found.as_json(), indent=2) + "\n", encoding="utf-8")
    draw(found).savefig(folder / "workspace.png", dpi=200)


def _print(found: Workspace, folder: Path) -> None:
    from tcrctl.experiment.headline import count

    made = found.as_json()
    for axis, span in made["offset"].items():
        print(
            f"{axis.removesuffix('_mm')}: {span['min']:.0f} to {span['max']:.0f} mm beside the place at rest"
        )
    print(f"tilt: up to {made['tilt_deg']['max']:.0f} deg")
    print("height [mm]  radius [mm]  tilt [deg]  points")
    for band in made["bands"]:
        numbers = f"{band['height_mm']:11.0f}  {band['radius_mm']:11.0f}  {band['tilt_deg']:10.0f}"
        print(f"{numbers}  {band['points']:6d}")
    ends = ", ".join(f"{number} by {what}" for what, number in made["ray_ends"].items())
    print(message(f"{count(made['points'], 'point')}; rays ended: {ends}", width()))
    print(folder)
