"""``tcrctl validate SPEC...``: everything that is wrong with files, all at once."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from tcrctl.cli.options import AsJson, IsRobot, Overrides, Quiet


def validate(
    specs: Annotated[list[str], typer.Argument(metavar="SPEC...", help="Shipped names or YAML files.")],
    overrides: Overrides = None,
    robot: IsRobot = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Check experiment, identification and study files without running them; exit code 2 if there is a problem.

    Examples:
      tcrctl validate my_experiment.yaml
      tcrctl validate letter_t --set controller.prediction.horizon_s=0.3
      tcrctl validate identify_table2
      tcrctl validate --robot my_robot.yaml
    """
    from tcrctl.errors import InputError, Problem, SpecError

    problems: list[Problem] = []
    valid: list[str] = []
    for name in specs:
        try:
            notes = _load(name, overrides or (), robot=robot)
            for note in () if quiet else notes:
                print(f"note: {note}", file=sys.stderr)
            valid.append(name)
        except SpecError as error:
            problems += error.problems
        except InputError as error:
            said = str(error).removeprefix(f"{name}: ")
            problems.append(Problem(name, "", f"{said}. {error.hint}" if error.hint else said))
    if not (as_json or quiet):
        for name in valid:
            print(f"{name}: ok")
    if problems:
        raise SpecError(list(dict.fromkeys(problems)))  # a bad --set is the same for all
    if as_json:
        print(json.dumps({"status": "ok", "valid": valid}))


def _load(name: str, overrides: Sequence[str], *, robot: bool) -> Sequence[str]:
    """Read a file of any kind with all its checks, and return what the user should know."""
    from tcrctl.config import shipped
    from tcrctl.experiment.again import load_experiment
    from tcrctl.robot.description import load_robot
    from tcrctl.robot.doubts import doubts

    if robot:
        return list(doubts(load_robot(name, overrides=overrides)))
    if shipped.is_identification(name):
        from tcrctl.identify.loading import load_identification

        load_identification(name, overrides)
    elif shipped.is_study(name):
        from tcrctl.study.command_line import told_study
        from tcrctl.study.plan import planned

        planned(told_study(name, overrides))
    else:
        return load_experiment(name, overrides).notes
    return ()
