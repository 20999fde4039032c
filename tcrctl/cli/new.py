"""``tcrctl new NAME``: a starter experiment."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated

import typer


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the experiment, or path of its file.")],
    start: Annotated[
        str, typer.Option("--from", metavar="SPEC", help="Experiment to start from.")
    ] = "letter_t",
) -> None:
    """Write a new experiment file, a copy of an existing one under a new name.

    Examples:
      tcrctl new my_letter
      tcrctl new studies/slow.yaml --from letter_i
    """
    from tcrctl.errors import DeviceError, InputError
    from tcrctl.experiment.spec import load_spec

    path = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    loaded = load_spec(start)
    text = _renamed(loaded.given_text.decode("utf-8-sig"), path, start)
    if "/" in loaded.spec.robot or loaded.spec.robot.endswith((".yaml", ".yml")):
        robot = os.path.relpath(loaded.robot_path, path.parent).replace(os.sep, "/")
        text = _with_value(text, "robot", robot if "/" in robot else f"./{robot}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path} exists already; it is not overwritten") from None
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror}") from None
    print(path)


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
