"""A ray in the space of drive lengths: from rest straight on, equilibrium by equilibrium, until a limit is met."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from tcrctl.errors import NoEquilibriumError
from tcrctl.executors.carried import Carried
from tcrctl.robot import pose
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array

#: A ray ends when it is this long [m], whatever the strokes are.
LONGEST: Final = 2.0
End: TypeAlias = Literal["stroke", "slack", "tight", "no equilibrium", "long"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a ray ends.

    Attributes:
        floor: Lowest tension [N].
        ceiling: Highest tension [N].
        spacing: Change of the fastest drive between two points [m].
    """

    floor: float
    ceiling: float
    spacing: float


@dataclass(frozen=True, slots=True)
class Ray:
    """What lies on a ray.

    Attributes:
        drive: Drive lengths (n, m) [m].
        position: End position (n, 3) [m].
        normal: End normal (n, 3).
        tension: Cable tensions (n, m) [N].
        end: What ended it.
    """

    drive: Array
    position: Array
    normal: Array
    tension: Array
    end: End


def cast(order: tuple[int, Carried[RobotDescription], Array, Limits]) -> Ray:
    """Follow one direction, in a worker process.

    Args:
        order: Number of the ray, robot, direction (m,), limits.
    """
    _, description, direction, limits = order
    return follow(_built(description), direction, limits)


_ROBOTS: dict[str, Robot] = {}


def _built(description: Carried[RobotDescription]) -> Robot:
    if description.key not in _ROBOTS:
        _ROBOTS.clear()
        _ROBOTS[description.key] = build_robot(description.value)
    return _ROBOTS[description.key]


def follow(robot: Robot, direction: Array, limits: Limits) -> Ray:
    """Follow one direction from rest; the rest itself is the first point.

    Args:
        robot: The robot.
        direction: In the space of drives (m,), not zero; its length does not matter.
        limits: Where it ends; strokes are the robot's.
    """
    change = limits.spacing * direction / np.max(np.abs(direction))
    low, high = robot.stroke
    drive = np.zeros(robot.n_cables)
    shape = robot.rest
    points = []
    end: End = "long"
    for _ in range(int(LONGEST / limits.spacing)):
        points.append(
            (drive, pose.position(shape.q, robot.tip), pose.normal(shape.q, robot.tip), shape.tension)
        )
        further = drive + change
        if np.any(further < low) or np.any(further > high):
            end = "stroke"
            break
        try:
            shape = equilibrium(robot.model, further, robot.weight, shape.q, drive)
        except NoEquilibriumError:
            end = "no equilibrium"
            break
        if shape.tension.min() < limits.floor or shape.tension.max() > limits.ceiling:
            end = "slack" if shape.tension.min() < limits.floor else "tight"
            break
        drive = further
    drives, positions, normals, tensions = (np.array(column) for column in zip(*points, strict=True))
    return Ray(drives, positions, normals, tensions, end)
