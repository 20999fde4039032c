"""``tcrctl schema``: the JSON Schema of experiment or robot files."""

from __future__ import annotations

import json

from tcrctl.cli.options import IsRobot


def schema(robot: IsRobot = False) -> None:
    r"""Print the JSON Schema of experiment files, for completion and checks in an editor.

    \b
    Example:
      tcrctl schema > tcrctl.schema.json
    and as the first line of an experiment file:
      # yaml-language-server: $schema=tcrctl.schema.json
    """
    from tcrctl.robot.description import RobotDescription
    from tcrctl.spec import ExperimentSpec

    model = RobotDescription if robot else ExperimentSpec
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema", **model.model_json_schema()}
    print(json.dumps(made, indent=2))
