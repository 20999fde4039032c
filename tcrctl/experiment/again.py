"""A run that is done once more from its own folder, which holds everything that it was made of.

The resolved experiment names its robots and rig as the user did; beside it lie their files as they were, and those
count, whatever the names mean today.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec, load_spec
from tcrctl.experiment.table_file import kept_name
from tcrctl.log.file_names import DESIGNED, RESOLVED, RIG, ROBOT

#: Keys that name files, and the file beside the resolved experiment that is meant.
_NAMED: Final = {"robot": ROBOT, "plant.robot": DESIGNED, "plant.rig": RIG}


def load_experiment(name_or_path: str, overrides: Sequence[str] = ()) -> LoadedSpec:
    """Read an experiment, or what was run, from the run's folder.

    Args:
        name_or_path: Shipped name, path of a YAML file, or folder of a run.
        overrides: As for :func:`tcrctl.experiment.spec.load_spec`.

    Raises:
        InputError: As there; and if the folder does not hold its robot.
    """
    path = Path(name_or_path).expanduser()
    if path.is_dir() and (path / RESOLVED).is_file():
        return _load_run(path, overrides)
    if path.name == RESOLVED and (path.parent / ROBOT).is_file():
        return _load_run(path.parent, overrides)
    return load_spec(name_or_path, overrides)


def _load_run(folder: Path, overrides: Sequence[str]) -> LoadedSpec:
    spec = folder / RESOLVED
    if not (folder / ROBOT).is_file():
        raise InputError(
            f"{folder}: the run was made by an older version and does not hold its robot's file",
            hint=f"tcrctl run {shlex.quote(str(spec))} takes the robot that has its name today.",
        )
    given = {text.partition("=")[0].strip() for text in overrides}
    named = {**_NAMED, "trajectory.file": kept_name(str(_names(spec).get("trajectory.file")))}
    beside = {key: folder / name for key, name in named.items() if (folder / name).is_file()}
    meant = {key: path for key, path in beside.items() if not _replaced(key, given)}
    texts = [f"{key}={json.dumps(str(path.absolute()))}" for key, path in meant.items()]
    loaded = load_spec(str(spec), (*texts, *overrides))
    return replace(loaded, spec=_as_named(loaded, _names(spec), meant), overrides=tuple(overrides))


def _replaced(key: str, given: set[str]) -> bool:
    """Tell whether the user gives a key, or a section around it, or its kind."""
    section = key.partition(".")[0]
    return bool({key, section, f"{section}.kind"} & given)


def _names(spec: Path) -> dict[str, Any]:
    """Return the names of robots and rig as the user wrote them, by dotted key."""
    data = strict_yaml.load(spec).data
    names = {"robot": data.get("robot")}
    plant = data.get("plant")
    if isinstance(plant, dict):
        names |= {"plant.robot": plant.get("robot"), "plant.rig": plant.get("rig")}
    trajectory = data.get("trajectory")
    if isinstance(trajectory, dict) and "file" in trajectory:
        names["trajectory.file"] = trajectory["file"]
    return names


def _as_named(loaded: LoadedSpec, names: dict[str, Any], meant: dict[str, Path]) -> ExperimentSpec:
    """Return the experiment with the names of the files, so that it is written again as it was."""
    spec = loaded.spec
    plant = {key.partition(".")[2]: names[key] for key in meant if key.startswith("plant.")}
    changes: dict[str, Any] = {"plant": spec.plant.model_copy(update=plant)} if plant else {}
    if "trajectory.file" in meant:
        changes["trajectory"] = spec.trajectory.model_copy(update={"file": names["trajectory.file"]})
    if "robot" in meant:
        changes["robot"] = names["robot"]
    return spec.model_copy(update=changes)
