"""``tcrctl show SPEC``: an experiment, identification, study, robot or rig with every default filled in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tcrctl.cli.options import AsJson, IsRobot, Overrides, Spec

if TYPE_CHECKING:
    from tcrctl.config.settings import Settings

#: Lines are broken behind this column, as in all files that are written.
_WIDEST: Final = 100
#: Most entries of a line are shorter: ``start_frame_deg: 10.0, ``.
_ENTRY: Final = 25


def show(
    spec: Spec,
    overrides: Overrides = None,
    robot: IsRobot = False,
    rig: Annotated[bool, typer.Option("--rig", help="Rig files instead of experiments.")] = False,
    as_json: AsJson = False,
) -> None:
    """Print an experiment as it will run: defaults filled in, --set applied. A robot file keeps its comments.

    Examples:
      tcrctl show letter_t
      tcrctl show letter_t --set controller.tension=off --json
      tcrctl show --robot tcr700
      tcrctl show --rig loopback
    """
    from tcrctl.config import strict_yaml

    found = _rig(spec, overrides, robot=robot) if rig else _found(spec, overrides or (), robot=robot)
    if as_json:
        print(found.model_dump_json())
    elif robot:
        from tcrctl.config import shipped
        from tcrctl.config.commented import with_values

        text = strict_yaml.read(shipped.find_robot(spec)).decode("utf-8-sig")
        print(with_values(text, found.model_dump(mode="json")), end="")
    else:
        print(strict_yaml.dumps(found.model_dump(mode="json"), _columns()), end="")


def _columns() -> int:
    """Return the column behind which lines are broken, so that they fit into the terminal."""
    from tcrctl.cli.layout import width

    return min(_WIDEST, max((width() or _WIDEST + _ENTRY) - _ENTRY, _ENTRY))


def _rig(name: str, overrides: Sequence[str] | None, *, robot: bool) -> Settings:
    from tcrctl.errors import InputError
    from tcrctl.plant.rig.file import read_rig

    if robot or overrides:
        raise InputError("--rig goes with neither --robot nor --set")
    return read_rig(name)[0]


def _found(name: str, overrides: Sequence[str], *, robot: bool) -> Settings:
    from tcrctl.config import shipped
    from tcrctl.experiment.again import load_experiment
    from tcrctl.experiment.spec import with_draws
    from tcrctl.robot.description import load_robot

    if robot:
        return load_robot(name, overrides=overrides)
    if shipped.is_identification(name):
        from tcrctl.identify.loading import load_identification

        return load_identification(name, overrides).spec
    if shipped.is_study(name):
        from tcrctl.study.command_line import told_study

        return told_study(name, overrides).spec
    loaded = load_experiment(name, overrides)
    return with_draws(loaded.spec, len(loaded.robot.cables.routes))
