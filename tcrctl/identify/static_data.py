"""Static data: drive lengths and where points of the robot came to rest, from YAML or CSV.

YAML:  configurations: [{name: ..., drives_mm: [...], points_mm: {m13.apex: [x, y, z], ring8: [x, null, z]}}]
CSV:   configuration, drive_<cable>_mm ..., point, x_mm, y_mm, z_mm; one row per point, an empty cell is unknown
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, model_validator

from tcrctl.config import strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import Settings, quantity, refuse
from tcrctl.identify.points import node_rows
from tcrctl.identify.table_data import read_table
from tcrctl.robot.description import RobotDescription, cable_routes

Coordinates = tuple[float | None, float | None, float | None]
UNKNOWN: Coordinates = (None, None, None)
#: If the longest drive is below this part of the stroke, it is not in mm.
METRES = 500.0


class ConfigurationSettings(Settings):
    """One static configuration."""

    name: str = Field(description="name in reports", min_length=1)
    drives_mm: tuple[float, ...] = quantity("mm", "drive length of every cable, in the robot's order")
    points_mm: dict[str, Coordinates] = quantity(
        "mm", "measured points: node, ring centre (ring8) or end -> [x, y, z]; null is not measured"
    )


class StaticDataSettings(Settings):
    """A file of static configurations."""

    source: str = Field(default="", description="where the data come from")
    configurations: tuple[ConfigurationSettings, ...] = Field(
        description="one entry per configuration", min_length=1
    )

    @model_validator(mode="after")
    def _named_once(self) -> StaticDataSettings:
        refuse(_repeated(self))
        return self


def _repeated(data: StaticDataSettings) -> Iterator[Finding]:
    names = Counter(entry.name for entry in data.configurations)
    for i, entry in enumerate(data.configurations):
        if names[entry.name] > 1:
            yield ("configurations", i, "name"), f"the name {entry.name!r} is used {names[entry.name]} times"
        if all(value is None for point in entry.points_mm.values() for value in point):
            yield ("configurations", i, "points_mm"), "nothing is measured in this configuration"


@dataclass(frozen=True, slots=True)
class Configuration:
    """One static configuration, SI units.

    Attributes:
        name: Its name.
        drive: Drive lengths (m,) [m].
        points: Names of the measured points.
        rows: Node rows whose mean each point is.
        position: Measured coordinates [m]; NaN where not measured.
    """

    name: str
    drive: tuple[float, ...]
    points: tuple[str, ...]
    rows: tuple[tuple[int, int, int], ...]
    position: tuple[tuple[float, ...], ...]


def read_static(path: Path, robot: RobotDescription) -> tuple[Configuration, ...]:
    """Read a file of static data and hold it against a robot.

    Args:
        path: A ``.csv`` file; anything else is read as YAML.
        robot: The robot that was measured.

    Raises:
        SpecError: If the file does not fit its format or the robot; all problems are listed.
        InputError: If it cannot be read.
    """
    table = path.suffix.lower() == ".csv"
    names = [route.name for route in cable_routes(robot)]
    document = read_table(path, names) if table else strict_yaml.load(path)
    data = strict_yaml.validate(document, StaticDataSettings)
    document.refuse(_misfits(data, robot, names))
    return tuple(_configuration(entry, robot) for entry in data.configurations)


def _misfits(data: StaticDataSettings, robot: RobotDescription, cables: list[str]) -> Iterator[Finding]:
    low, high = robot.stroke_mm
    longest = max((abs(drive) for entry in data.configurations for drive in entry.drives_mm), default=0.0)
    if 0.0 < longest < (high - low) / METRES:
        yield (
            ("configurations",),
            f"no drive moves by more than {longest:g} mm; are the lengths in metres? They must be in mm",
        )
    for i, entry in enumerate(data.configurations):
        here: Keys = ("configurations", i, "drives_mm")
        if len(entry.drives_mm) != len(cables):
            has = f"{robot.name} has {len(cables)} cables, {', '.join(cables)}"
            yield here, f"{has}; there are {len(entry.drives_mm)} lengths"
        for c, drive in enumerate(entry.drives_mm):
            if not low <= drive <= high:
                hint = "; are these micrometres?" if abs(drive) > 20 * max(-low, high) else ""
                yield (*here, c), f"{drive:g} mm is outside the stroke, {low:g} to {high:g} mm{hint}"
        for name in entry.points_mm:
            try:
                node_rows(name, robot)
            except ValueError as error:
                yield ("configurations", i, "points_mm", name), str(error)


def _configuration(entry: ConfigurationSettings, robot: RobotDescription) -> Configuration:
    measured = {name: point for name, point in entry.points_mm.items() if point != UNKNOWN}
    return Configuration(
        name=entry.name,
        drive=tuple(drive / 1e3 for drive in entry.drives_mm),
        points=tuple(measured),
        rows=tuple(node_rows(name, robot) for name in measured),
        position=tuple(
            tuple(math.nan if value is None else value / 1e3 for value in point)
            for point in measured.values()
        ),
    )
