"""``tcrctl schema``: the JSON Schema of experiment, robot or rig files."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from tcrctl.cli.options import IsRobot


def schema(
    robot: IsRobot = False,
    rig: Annotated[bool, typer.Option("--rig", help="Rig files instead of experiments.")] = False,
) -> None:
    r"""Print the JSON Schema of experiment files, for completion and checks in an editor.

    \b
    Example:
      tcrctl schema > tcrctl.schema.json
    and as the first line of an experiment file:
      # yaml-language-server: $schema=tcrctl.schema.json
    """
    from tcrctl.errors import InputError
    from tcrctl.plant.rig_settings import RigFile
    from tcrctl.robot.description import RobotDescription
    from tcrctl.spec import ExperimentSpec

    if robot and rig:
        raise InputError("give --robot or --rig, not both")
    model = RobotDescription if robot else RigFile if rig else ExperimentSpec
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema", **model.model_json_schema()}
    print(json.dumps(made, indent=2))
