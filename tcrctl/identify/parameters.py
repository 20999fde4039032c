"""The numbers that are to be found: paths into the robot file, bounds, and the map to the unit interval."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcrctl.config.keys import Keys
from tcrctl.robot.description import RobotDescription
from tcrctl.signals import Array

#: How far default bounds reach from the robot's own value.
DEFAULT_FACTOR = 2.0


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter.

    Attributes:
        path: Dotted path in the robot file.
        start: Value of the robot as given.
        low: Lower bound.
        high: Upper bound.
        log: Walked through in equal ratios instead of equal steps.
    """

    path: str
    start: float
    low: float
    high: float
    log: bool

    def value(self, x: float) -> float:
        """Return the value at ``x`` of the unit interval."""
        if self.log:
            return float(self.low * (self.high / self.low) ** x)
        return float(self.low + (self.high - self.low) * x)

    def unit(self, value: float) -> float:
        """Place of ``value`` in the unit interval."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, x: float) -> float:
        """Return the derivative of the value with respect to ``x``."""
        if self.log:
            return self.value(x) * math.log(self.high / self.low)
        return self.high - self.low


def values(parameters: Sequence[Parameter], x: Array) -> dict[str, float]:
    """Return the values by path at ``x`` (n,) of the unit cube."""
    return {p.path: p.value(float(u)) for p, u in zip(parameters, x, strict=True)}


def start_of(parameters: Sequence[Parameter]) -> Array:
    """Return the robot as given (n,), in the unit cube."""
    return np.array([p.unit(p.start) for p in parameters])


def split(path: str) -> Keys:
    """Return the keys of a dotted path; numbers are list indices."""
    return tuple(int(key) if key.isdecimal() else key for key in path.split("."))


def look_up(data: Any, path: str) -> float:
    """Return the number at a dotted path of a robot as plain data.

    Raises:
        ValueError: If there is none; the message says what there is instead.
    """
    value, done = data, "the robot file"
    for key in split(path):
        value, done = _step(value, key, done), f"{key}" if done == "the robot file" else f"{done}.{key}"
    if isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool)):
        return float(value)
    if value is None:
        raise ValueError(f"{path} is not given in this robot, so there is no value to start from")
    kind = "a section" if isinstance(value, dict) else "a list" if isinstance(value, list) else repr(value)
    raise ValueError(f"{path} is {kind}, not a number")


def _step(value: Any, key: str | int, done: str) -> Any:
    if isinstance(value, dict):
        if key not in value:
            raise ValueError(f"{done} has no {key}; it has {', '.join(value)}")
        return value[key]
    if isinstance(value, list):
        if not isinstance(key, int) or key >= len(value):
            raise ValueError(f"{done} is a list of {len(value)}, there is no index {key}; 0 is the first")
        return value[key]
    raise ValueError(f"{done} is {value!r}, there is nothing below it")


def with_values(robot: RobotDescription, changes: Mapping[str, Any]) -> RobotDescription:
    """Return the robot with other values at dotted paths.

    Args:
        robot: What to start from.
        changes: New values by path.

    Raises:
        ValidationError: If the values make no valid robot.
    """
    data = copy.deepcopy(robot.model_dump(mode="json"))
    for path, value in changes.items():
        keys = split(path)
        place: Any = data
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value
    return RobotDescription.model_validate_json(json.dumps(data))
