"""``plant.robot``: a simulated plant that has another robot than the one that the controller knows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError
from tcrctl.plant.settings import PlantSettings, SimulatedSettings
from tcrctl.robot.description import RobotDescription, cable_routes

if TYPE_CHECKING:
    from tcrctl.robot.robot import Robot

#: Where it stands in an experiment.
KEYS: Keys = ("plant", "robot")


def plant_robot(
    document: Document, plant: PlantSettings, robot: RobotDescription, robot_path: Path
) -> RobotDescription | None:
    """Return the robot of the plant as designed; None if it is the controller's.

    Args:
        document: The experiment's file, for messages.
        plant: Its plant.
        robot: The robot that the controller knows.
        robot_path: Its file.

    Raises:
        SpecError: If there is no such robot, it has problems or other rings and cables.
    """
    given = plant.robot if isinstance(plant, SimulatedSettings) else None
    if given is None:
        return None
    own = _named(document, given) if isinstance(given, str) else _changed(document, given, robot_path)
    document.refuse(misfits(own, robot))
    return own


def misfits(own: RobotDescription, robot: RobotDescription) -> Iterator[Finding]:
    """Yield what the plant's robot must have in common with the controller's, and has not."""
    if own.modules.count != robot.modules.count:
        yield KEYS, f"has {own.modules.count} modules; {robot.name} has {robot.modules.count}"
    if own.tip.ring != robot.tip.ring:
        yield KEYS, f"has its tip at ring {own.tip.ring}; {robot.name} at ring {robot.tip.ring}"
    names, known = ([route.name for route in cable_routes(d)] for d in (own, robot))
    if names != known:
        yield KEYS, f"has cables {', '.join(names)}; {robot.name} has {', '.join(known)}"


def _named(document: Document, name: str) -> RobotDescription:
    at_hand = document.where(KEYS).startswith("--set")  # relative to where the user is
    folder = Path() if at_hand else Path(document.name).parent
    try:
        path = shipped.find_robot(name, folder)
    except InputError as error:
        document.refuse([(KEYS, str(error))])
        raise
    return strict_yaml.validate(strict_yaml.load(path), RobotDescription)


def _changed(document: Document, differences: Mapping[str, Any], robot_path: Path) -> RobotDescription:
    """Return the controller's robot with some values of its file changed."""
    # pydantic is slow to import
    from tcrctl.config.validation import check

    own, found = check(merged(strict_yaml.load(robot_path).data, differences), RobotDescription)
    document.refuse(((*KEYS, *keys), message) for keys, message in found)
    if own is None:
        raise AssertionError("a robot without findings is there")
    return own


def merged(base: Any, differences: Any) -> Any:
    """Return ``base`` with ``differences`` put in: maps key by key, everything else as a whole."""
    if not isinstance(base, Mapping) or not isinstance(differences, Mapping):
        return differences
    return {**base, **{key: merged(base.get(key), value) for key, value in differences.items()}}


def description_of_plant(
    plant: SimulatedSettings,
    robot: RobotDescription,
    own: RobotDescription | None,
    seed: int,
    built: Robot | None = None,
) -> RobotDescription | None:
    """Return the robot of a plant with everything drawn; None if it is the controller's.

    Args:
        plant: Settings, as they run.
        robot: The robot that the controller knows.
        own: The plant's as designed, if it is another one.
        seed: Of the run.
        built: ``robot``, if it is built already.

    Raises:
        NoEquilibriumError: If it has no stable shape as designed.
    """
    if own is None and plant.scatter is None:
        return None
    # numpy is slow to import, and a file is checked without it
    from tcrctl.plant.own_robot import own_description

    return own_description(plant, own or robot, built if own is None else None, seed)
