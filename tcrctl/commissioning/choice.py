"""Which rig, and which of the robots on it."""

from __future__ import annotations

from tcrctl.errors import InputError, UnknownNameError
from tcrctl.plant.rig.file import LoadedRig, load_rig, read_rig
from tcrctl.robot.description import RobotDescription, load_robot


def choose_all(rig: str, robot: str | None) -> list[tuple[LoadedRig, RobotDescription]]:
    """Return the robot of a rig that was named, or all of them.

    Args:
        rig: Shipped rig, or path of a rig file.
        robot: Name of a robot; None for all.

    Raises:
        InputError: If the file is missing or wrong, or the robot does not hang there.
    """
    file, path, *_ = read_rig(rig)
    if robot is not None and robot not in file.robots:
        raise UnknownNameError(f"robot on {path}", robot, list(file.robots))
    found = []
    for name in file.robots if robot is None else (robot,):
        description = load_robot(name)
        found.append((load_rig(rig, description), description))
    return found


def choose(rig: str, robot: str | None) -> tuple[LoadedRig, RobotDescription]:
    """Return the robot of a rig that was named, or the only one.

    Raises:
        InputError: As :func:`choose_all`, or if there are several and none was named.
    """
    found = choose_all(rig, robot)
    if len(found) > 1:
        names = ", ".join(loaded.robot for loaded, _ in found)
        raise InputError(f"on rig {rig} hang {names}; choose one with --robot")
    return found[0]
