"""``tcrctl new NAME``: a starter experiment, or robot."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.options import IsRobot


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the experiment, or path of its file.")],
    start: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="SPEC",
            help="Experiment or robot to start from; default: letter_t, with --robot tcr600.",
        ),
    ] = None,
    robot: IsRobot = False,
) -> None:
    """Write a new experiment file, a copy of an existing one under a new name; with --robot a robot file.

    A robot file says behind every key what it means and in which unit.

    Examples:
      tcrctl new my_letter
      tcrctl new studies/slow.yaml --from letter_i
      tcrctl new --robot robots/mine.yaml --from tcr700
    """
    path = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    _write(path, _robot(path, start or "tcr600") if robot else _experiment(path, start or "letter_t"))
    print(path)


def _robot(path: Path, start: str) -> str:
    from tcrctl.config import shipped, strict_yaml
    from tcrctl.config.commented import with_descriptions
    from tcrctl.robot.description import RobotDescription, load_robot

    load_robot(start)  # says what is wrong with it
    text = strict_yaml.read(shipped.find_robot(start)).decode("utf-8-sig")
    made = with_descriptions(_with_value(text, "name", path.stem), RobotDescription)
    strict_yaml.validate(strict_yaml.loads(made, str(path)), RobotDescription)
    return made


def _experiment(path: Path, start: str) -> str:
    from tcrctl.experiment.spec import load_spec

    loaded = load_spec(start)
    text = _renamed(loaded.given_text.decode("utf-8-sig"), path, start)
    if "/" in loaded.spec.robot or loaded.spec.robot.endswith((".yaml", ".yml")):
        robot = os.path.relpath(loaded.robot_path, path.parent).replace(os.sep, "/")
        text = _with_value(text, "robot", robot if "/" in robot else f"./{robot}")
    return text


def _write(path: Path, text: str) -> None:
    from tcrctl.errors import DeviceError, InputError
    from tcrctl.experiment.run_folder import make_folder_for

    make_folder_for(path)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already", hint="Give another name.") from None
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror}") from None


def _renamed(text: str, path: Path, start: str) -> str:
    from tcrctl.config import strict_yaml
    from tcrctl.experiment.spec import ExperimentSpec

    text = _with_value(text, "name", path.stem)
    text = _with_value(text, "source", f"started from {Path(start).stem}")
    strict_yaml.validate(strict_yaml.loads(text, str(path)), ExperimentSpec)
    return text


def _with_value(text: str, key: str, value: str) -> str:
    """Replace the value of a key at the top level of a file, keeping every comment."""
    return re.sub(rf"^{key}:.*$", lambda _: f"{key}: {value}", text, count=1, flags=re.MULTILINE)
