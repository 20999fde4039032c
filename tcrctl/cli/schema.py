"""``tcrctl schema``: the JSON Schema of experiment, robot, rig, identification or study files."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from tcrctl.cli.options import IsRobot


def schema(
    robot: IsRobot = False,
    rig: Annotated[bool, typer.Option("--rig", help="Rig files instead of experiments.")] = False,
    identification: Annotated[
        bool, typer.Option("--identification", help="Identification files instead of experiments.")
    ] = False,
    study: Annotated[bool, typer.Option("--study", help="Study files instead of experiments.")] = False,
) -> None:
    """Print the JSON Schema of experiment files, for completion and checks in an editor.

    Example:
      tcrctl schema > tcrctl.schema.json
    and as the first line of an experiment file:
      # yaml-language-server: $schema=tcrctl.schema.json
    """
    from tcrctl.config.settings import Settings
    from tcrctl.errors import InputError
    from tcrctl.experiment.plugged import with_registered
    from tcrctl.experiment.spec import ExperimentSpec
    from tcrctl.identify.settings import IdentificationSpec
    from tcrctl.plant.rig import plugged
    from tcrctl.robot.description import RobotDescription
    from tcrctl.study.settings import StudySpec

    kinds: list[tuple[bool, type[Settings]]] = [
        (robot, RobotDescription),
        (rig, plugged.with_registered()),
        (identification, IdentificationSpec),
        (study, StudySpec),
    ]
    wanted = [kind for given, kind in kinds if given]
    if len(wanted) > 1:
        raise InputError("give --robot, --rig, --identification or --study, not several of them")
    model = wanted[0] if wanted else with_registered(ExperimentSpec)
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema", **model.model_json_schema()}
    print(json.dumps(made, indent=2))
