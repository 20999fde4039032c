"""The files of its run that a log carries, read by everybody who wants them in one way.

=======================  ==========================================================================================
``spec.yaml``            the experiment as it was given
``spec.resolved.yaml``   the same with every default and ``--set`` filled in: what ran
``robot.yaml``           the robot that the controller knew
``plant_robot.yaml``     the robot of a simulated plant, with everything drawn, if it was another one
``plant_cameras.json``   what was wrong with its cameras from beginning to end, if anything was drawn
``rig.yaml``             the bench, if there was one
``plugins.json``         where kinds come from that are not built in: package, version, digest
``plugin.NAME.py``       the text of such a kind that is a file; it is never run
``versions.json``        versions of everything that the numbers depend on
=======================  ==========================================================================================
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError, TcrctlError
from tcrctl.log.file_names import RESOLVED, ROBOT, VERSIONS
from tcrctl.log.older_settings import in_todays_form
from tcrctl.log.reader import Log

if TYPE_CHECKING:
    from tcrctl.robot.description import RobotDescription

#: Most characters of a whole number that a run writes: 64 bits and a sign.
LONGEST_WHOLE: Final = 20


class RunFiles:
    """Files attached to one log."""

    def __init__(self, log: Log) -> None:
        """Read nothing yet.

        Args:
            log: The log.
        """
        self._path = log.path
        self._contents = {name: data for name, (_, data) in log.attachments.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all files, in the order written."""
        return tuple(self._contents)

    def __contains__(self, name: str) -> bool:
        return name in self._contents

    def content(self, name: str) -> bytes:
        """Return a file as it is; empty if there is none of that name."""
        return self._contents.get(name, b"")

    def place(self, name: str) -> str:
        """Return how a file is named in messages: ``log.mcap:robot.yaml``."""
        return f"{self._path}:{name}"

    def document(self, name: str) -> strict_yaml.Document:
        """Return a YAML file, settings of an older version in the form of today.

        Raises:
            InputError: If there is none of that name.
            SpecError: If it is not YAML.
        """
        if name not in self:
            has = ", ".join(self.names) or "none"
            raise InputError(f"{self._path}: it has no attachment {name}; attachments: {has}")
        read = strict_yaml.loads(self._contents[name], self.place(name))
        return replace(read, data=in_todays_form(read.data)) if name == RESOLVED else read

    def robot(self) -> RobotDescription:
        """Return the robot.

        Raises:
            InputError: If the log has no robot file.
            SpecError: If it is not valid for this version of the program.
        """
        # pydantic is slow to import, and the other files need none of it
        from tcrctl.robot.description import RobotDescription

        return strict_yaml.validate(self.document(ROBOT), RobotDescription)

    def robot_if_known(self) -> RobotDescription | None:
        """Return the robot; None if there is none that this version understands."""
        try:
            return self.robot()
        except TcrctlError:
            return None

    def data(self, name: str) -> Any:
        """Return what a YAML file holds; None if it is not there or cannot be read."""
        try:
            return self.document(name).data
        except TcrctlError:
            return None

    def versions(self) -> dict[str, Any]:
        """Return versions by name; empty if the log does not say any."""
        return json_map(self.content(VERSIONS))

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yield name and text of every file that is text."""
        for name, data in self._contents.items():
            try:
                yield name, data.decode("utf-8")
            except UnicodeDecodeError:
                continue


def json_of(text: str | bytes) -> Any:
    """Return what a text holds as JSON, so that it can be printed as JSON again and be compared.

    What JSON has no word for (NaN, infinity) and whole numbers that no run writes are null.

    Raises:
        ValueError: If it holds something else.
    """
    try:
        return json.loads(text, parse_constant=lambda _: None, parse_float=_finite, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def _finite(text: str) -> float | None:
    number = float(text)
    return number if math.isfinite(number) else None


def _whole(text: str) -> int | None:
    return int(text) if len(text) <= LONGEST_WHOLE else None


def json_map(text: str | bytes) -> dict[str, Any]:
    """Return the map that a text holds as JSON, as ``json_of``; empty if it is something else."""
    try:
        found = json_of(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
