"""Experiments, identifications, studies, robots and rigs that come with the program, by name.

Robots lie in the package. Experiments and rigs lie in ``experiments/`` and ``hardware/rigs/`` beside it in a
checkout, and inside it in an installed wheel. The names of identifications, which lie with the experiments,
begin with ``identify_``; studies lie in ``studies/`` below them.
"""

from __future__ import annotations

import difflib
import shlex
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from tcrctl.errors import InputError, UnknownNameError
from tcrctl.regular_file import open_file, other_kind

_PACKAGE = Path(__file__).parents[1]
_IDENTIFY = "identify_"


def experiments() -> dict[str, Path]:
    """Return the files of the shipped experiments by name, sorted."""
    return {name: path for name, path in _experiment_files().items() if not name.startswith(_IDENTIFY)}


def identifications() -> dict[str, Path]:
    """Return the files of the shipped identifications by name, sorted."""
    return {name: path for name, path in _experiment_files().items() if name.startswith(_IDENTIFY)}


def studies() -> dict[str, Path]:
    """Return the files of the shipped studies by name, sorted."""
    return _by_name(_experiment_folder() / "studies")


def _experiment_files() -> dict[str, Path]:
    return _by_name(_experiment_folder())


def _experiment_folder() -> Path:
    inside = _PACKAGE / "experiments"
    return inside if inside.is_dir() else _PACKAGE.parent / "experiments"


def robots() -> dict[str, Path]:
    """Return the files of the shipped robots by name, sorted."""
    return _by_name(_PACKAGE / "robot" / "models")


def rigs() -> dict[str, Path]:
    """Return the files of the shipped rigs by name, sorted."""
    inside = _PACKAGE / "rigs"
    return _by_name(inside if inside.is_dir() else _PACKAGE.parent / "hardware" / "rigs")


def find_experiment(name_or_path: str) -> Path:
    """Return the file of an experiment.

    Args:
        name_or_path: Shipped name, or path of a YAML file.

    Raises:
        UnknownNameError: If there is no shipped experiment of that name.
        InputError: If the path leads to no file.
    """
    if is_identification(name_or_path):
        raise InputError(
            f"{name_or_path} is an identification, not an experiment",
            hint=f"Start it with: tcrctl identify {shlex.quote(name_or_path)}",
        )
    if is_study(name_or_path):
        raise InputError(
            f"{name_or_path} is a study, not an experiment",
            hint=f"Start it with: tcrctl sweep {shlex.quote(name_or_path)}",
        )
    path = _find("experiment", name_or_path, experiments(), Path())
    if path not in experiments().values():
        _refuse_other_kinds(path, "an experiment")
    return path


def shadowed(name: str) -> Path | None:
    """Return the file of a shipped name that also lies in the working directory, where it is not looked for."""
    local = Path(f"{name}.yaml")
    return local if not is_path(name) and _is_file(local) else None


def notes(name: str) -> tuple[str, ...]:
    """Return what the user should know about the name of an experiment."""
    local = shadowed(name)
    if local is None:
        return ()
    return (f"{name} is the experiment that comes with the program; ./{local} in this folder is not read",)


#: Sections that only files of one kind have, what those are, and what they are for.
_SECTIONS: dict[str, tuple[str, str]] = {
    "trajectory": ("an experiment", "tcrctl run {}"),
    "modules": ("a robot file", "Name it in an experiment, robot: {}; tcrctl validate --robot {} checks it."),
    "cameras": ("a rig file", "Name it in an experiment, plant: {{kind: rig, rig: {}}}; tcrctl rig check {}"),
    "faults": ("a fault script", "tcrctl emulate --faults {}"),
}


def _refuse_other_kinds(path: Path, wanted: str) -> None:
    """Raise an InputError that says what a file is, if it is something else than what is wanted."""
    from tcrctl.config import strict_yaml

    shown = shlex.quote(str(path))
    if _begins(path, b"\x89MCAP"):  # before it is read: most logs are larger than such files may be
        hint = f"tcrctl run {shlex.quote(str(path.parent))} does the run again; tcrctl info {shown} shows the log."
        raise InputError(f"{path}: this is a log, not {wanted}", hint=hint)
    try:
        keys = _keys_in(strict_yaml.read(path))
    except InputError:
        return  # whoever reads it says what is wrong
    found = {kind: use for section, (kind, use) in _SECTIONS.items() if section in keys}
    if found and wanted not in found:
        kind, use = next(iter(found.items()))
        raise InputError(f"{path}: this is {kind}, not {wanted}", hint=use.replace("{}", shown))


def _begins(path: Path, mark: bytes) -> bool:
    try:
        with open_file(path) as file:
            return file.read(len(mark)) == mark
    except OSError:  # whoever reads it says what is wrong
        return False


def find_identification(name_or_path: str) -> Path:
    """Return the file of an identification.

    Args:
        name_or_path: Shipped name, or path of a YAML file.

    Raises:
        UnknownNameError: If there is no shipped identification of that name.
        InputError: If the path leads to no file.
    """
    return _find("identification", name_or_path, identifications(), Path())


def find_study(name_or_path: str) -> Path:
    """Return the file of a study.

    Args:
        name_or_path: Shipped name, or path of a YAML file.

    Raises:
        UnknownNameError: If there is no shipped study of that name.
        InputError: If the path leads to no file.
    """
    return _find("study", name_or_path, studies(), Path())


def find_robot(name_or_path: str, folder: Path | None = None) -> Path:
    """Return the file of a robot.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        folder: Where a relative path starts; the working directory if left out.

    Raises:
        UnknownNameError: If there is no shipped robot of that name.
        InputError: If the path leads to no file.
    """
    path = _find("robot", name_or_path, robots(), folder or Path())
    if path not in robots().values():
        _refuse_other_kinds(path, "a robot file")
    return path


def find_rig(name_or_path: str, folder: Path | None = None) -> Path:
    """Return the file of a rig.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        folder: Where a relative path starts; if there is nothing, the working directory is tried.

    Raises:
        UnknownNameError: If there is no shipped rig of that name.
        InputError: If the path leads to no file.
    """
    if folder is not None and is_path(name_or_path) and (folder / Path(name_or_path).expanduser()).is_file():
        path = folder / Path(name_or_path).expanduser()
    else:
        path = _find("rig", name_or_path, rigs(), Path())
    if path not in rigs().values():
        _refuse_other_kinds(path, "a rig file")
    return path


def is_identification(name_or_path: str) -> bool:
    """Tell whether a shipped name or a file is an identification; False if there is none or it cannot be read."""
    return _is_kind("identification", name_or_path, identifications())


def is_study(name_or_path: str) -> bool:
    """Tell whether a shipped name or a file is a study; an experiment of the same name comes first."""
    if name_or_path in experiments():
        return False
    return _is_kind("study", name_or_path, studies())


def _is_kind(kind: str, name_or_path: str, shipped: Mapping[str, Path]) -> bool:
    from tcrctl.config import strict_yaml

    if not is_path(name_or_path):
        return name_or_path in shipped
    try:
        return _kind_in(strict_yaml.read(Path(name_or_path).expanduser())) == kind
    except InputError:
        return False


def _kind_in(content: bytes) -> str:
    """Return what a file calls itself; empty if it does not."""
    kind = _keys_in(content).get("kind", "")
    return kind if isinstance(kind, str) else ""


@lru_cache(maxsize=8)
def _keys_in(content: bytes) -> dict[str, object]:
    """Return the top of a file; empty if it is no map. A long file is asked several times."""
    from tcrctl.config import strict_yaml

    data = strict_yaml.loads(content).data
    return data if isinstance(data, dict) else {}


def is_path(name_or_path: str) -> bool:
    """Tell a path (has a separator, or a dot, as before .yaml) from a shipped name, which has neither."""
    return any(mark in name_or_path for mark in ("/", "\\", "."))


def _missing(path: Path) -> str:
    if not (kind := other_kind(path)):
        return "there is no such file"
    return f"this is {kind}, not a file" + (", and not that of a run" if kind == "a folder" else "")


def _file_here(name: str, folder: Path) -> str | None:
    """Return the YAML file of a folder that a name is nearest to, if it is near to one."""
    try:
        stems = {path.stem: path.name for path in sorted(folder.glob("*.y*ml"))}
    except (OSError, ValueError):
        return None
    close = difflib.get_close_matches(Path(name[:100]).stem, stems, n=1, cutoff=0.8)
    return stems[close[0]] if close else None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # for instance a name longer than any can be
        return False


def _by_name(folder: Path) -> dict[str, Path]:
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def _find(kind: str, name_or_path: str, shipped: Mapping[str, Path], folder: Path) -> Path:
    if is_path(name_or_path):
        path = folder / Path(name_or_path).expanduser()
        if not _is_file(path):
            raise InputError(f"{path}: {_missing(path)}")
        return path
    if name_or_path == "-":
        raise InputError("-: standard input is not read", hint="Give the name of a file.")
    if name_or_path not in shipped:
        error = UnknownNameError(kind, name_or_path, list(shipped))
        here = _file_here(name_or_path, folder)
        if here is not None:
            error.hint = f"Did you mean {shlex.quote(here)}, which lies in this folder? Paths end in .yaml."
        raise error
    return shipped[name_or_path]
