"""SPEC (name or path) -> strict YAML -> --set -> IdentificationSpec, robot, parameters, static data."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Finding
from tcrctl.errors import Problem, SpecError
from tcrctl.identify.parameters import DEFAULT_FACTOR, Parameter, look_up, split, with_values
from tcrctl.identify.settings import DataSettings, IdentificationSpec, ParameterSettings
from tcrctl.identify.static_data import Configuration, read_static
from tcrctl.regular_file import other_kind
from tcrctl.robot.description import RobotDescription

LOG_SUFFIX = ".mcap"


@dataclass(frozen=True, slots=True)
class LogSource:
    """A log that is still to be read.

    Attributes:
        path: The file.
        settings: Which part of it counts.
    """

    path: Path
    settings: DataSettings


@dataclass(frozen=True, slots=True)
class LoadedIdentification:
    """An identification ready to be built.

    Attributes:
        spec: The identification.
        text: The file as given; the resolved one if it came from the command line.
        robot: The robot to start from.
        robot_path: Its file.
        parameters: What is to be found.
        configurations: All static configurations.
        logs: All logs.
        data_sha256: Hash over the contents of all data files, in order.
    """

    spec: IdentificationSpec
    text: bytes
    robot: RobotDescription
    robot_path: Path
    parameters: tuple[Parameter, ...]
    configurations: tuple[Configuration, ...]
    logs: tuple[LogSource, ...]
    data_sha256: str


def load_identification(name_or_path: str, overrides: Sequence[str] = ()) -> LoadedIdentification:
    """Read an identification, its robot and its static data.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        overrides: Assignments ``a.b=c``, applied in order.

    Raises:
        UnknownNameError: If there is no shipped identification of that name.
        SpecError: If a file has problems.
        InputError: If a file is missing.
    """
    path = shipped.find_identification(name_or_path)
    text = strict_yaml.read(path)
    return from_document(strict_yaml.loads(text, str(path)), text, path.parent, overrides)


def from_document(
    document: strict_yaml.Document, text: bytes, folder: Path, overrides: Sequence[str] = ()
) -> LoadedIdentification:
    """Make an identification of a document; see :func:`load_identification`.

    Args:
        document: What the file or the command line says.
        text: The same as text, for the record.
        folder: Where relative paths start.
        overrides: Assignments ``a.b=c``.
    """
    for assignment in overrides:
        document = strict_yaml.override(document, assignment)
    spec = strict_yaml.validate(document, IdentificationSpec)
    at_hand = document.where(("robot",)).startswith("--set")
    robot_path = shipped.find_robot(spec.robot, Path() if at_hand else folder)
    robot = strict_yaml.validate(strict_yaml.load(robot_path), RobotDescription)
    problems: list[Problem] = []
    parameters = tuple(_parameters(spec, robot, document, problems))
    configurations, logs = _data(spec, robot, folder, document, problems)
    problems += [document.problem(*found) for found in _misfits(spec, configurations, logs)]
    if problems:
        raise SpecError(problems)
    hashed = hashlib.sha256(b"".join(strict_yaml.read(folder / entry.file) for entry in spec.data))
    return LoadedIdentification(
        spec, text, robot, robot_path, parameters, configurations, logs, hashed.hexdigest()
    )


def _parameters(
    spec: IdentificationSpec, robot: RobotDescription, document: strict_yaml.Document, problems: list[Problem]
) -> Iterator[Parameter]:
    data = robot.model_dump(mode="json")
    for path, settings in spec.parameters.items():
        try:
            start = look_up(data, path)
            if isinstance(_field_value(robot, path), int):
                raise ValueError(f"{path} is a whole number; only real numbers can be identified")
            yield _bounded(path, start, settings, robot)
        except ValueError as error:
            problems.append(document.problem(("parameters", path), str(error)))


def _field_value(robot: RobotDescription, path: str) -> object:
    value: object = robot
    for key in split(path):
        value = value[key] if isinstance(key, int) else getattr(value, key)  # type: ignore[index]
    return value


def _bounded(path: str, start: float, settings: ParameterSettings, robot: RobotDescription) -> Parameter:
    near, far = sorted((start / DEFAULT_FACTOR, start * DEFAULT_FACTOR))
    low = near if settings.low is None else settings.low
    high = far if settings.high is None else settings.high
    if low == high:
        raise ValueError("is 0 in this robot, so low and high have to be given")
    if not low <= start <= high:
        raise ValueError(f"the robot has {start:g}, outside the bounds {low:g} to {high:g}")
    if settings.scale == "log" and low <= 0.0:
        raise ValueError(f"low must be > 0 with scale: log, not {low:g}")
    for bound in (low, high):
        try:
            with_values(robot, {path: bound})
        except ValidationError as error:
            raise ValueError(f"{bound:g} makes no valid robot: {error.errors()[0]['msg']}") from None
    log = low > 0.0 if settings.scale is None else settings.scale == "log"
    return Parameter(path, start, low, high, log)


def _data(
    spec: IdentificationSpec,
    robot: RobotDescription,
    folder: Path,
    document: strict_yaml.Document,
    problems: list[Problem],
) -> tuple[tuple[Configuration, ...], tuple[LogSource, ...]]:
    static: list[Configuration] = []
    logs: list[LogSource] = []
    for i, entry in enumerate(spec.data):
        path = folder / Path(entry.file).expanduser()
        if not path.is_file():
            wrong = f"this is {kind}, not a file" if (kind := other_kind(path)) else "there is no such file"
            problems.append(document.problem(("data", i, "file"), f"{path}: {wrong}"))
        elif path.suffix.lower() == LOG_SUFFIX:
            logs.append(LogSource(path, entry))
        else:
            try:
                static += read_static(path, robot)
            except SpecError as error:
                problems += error.problems
    return tuple(static), tuple(logs)


def _misfits(
    spec: IdentificationSpec, static: Sequence[Configuration], logs: Sequence[LogSource]
) -> Iterator[Finding]:
    names = [configuration.name for configuration in static]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield ("data",), f"two files have a configuration {name!r}"
    if spec.frame.offset == "displacement":
        if logs:
            yield ("frame", "offset"), "displacement is for static data; use fit with logs"
        yield from _reference_misfits(spec, static)


def _reference_misfits(spec: IdentificationSpec, static: Sequence[Configuration]) -> Iterator[Finding]:
    found = {configuration.name: configuration for configuration in static}
    if static and spec.frame.reference not in found:
        known = ", ".join(found)
        yield ("frame", "reference"), f"there is no configuration {spec.frame.reference!r}; known: {known}"
        return
    for configuration in static:
        missing = set(configuration.points) - set(found[spec.frame.reference].points)
        if missing:
            names = ", ".join(sorted(missing))
            yield (
                ("frame", "reference"),
                f"{names} of {configuration.name!r} is not measured in the reference",
            )
