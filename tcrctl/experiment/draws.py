"""What an experiment leaves to its seed: the plant as it is drawn, and the description of its robot."""

from __future__ import annotations

from typing import Any

from tcrctl.experiment.spec import ExperimentSpec
from tcrctl.plant.own_robot import own_description
from tcrctl.plant.realistic import as_drawn
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.robot import Robot


def with_draws(spec: ExperimentSpec, cables: int, seed: int | None = None) -> ExperimentSpec:
    """Return an experiment as it runs: with a seed, and with what ``plant.realistic`` draws.

    Args:
        spec: The experiment.
        cables: Number of cables of its robot.
        seed: Seed of everything random; its own if None.
    """
    changes: dict[str, Any] = {} if seed is None else {"seed": seed}
    if isinstance(spec.plant, SimulatedSettings):
        changes["plant"] = as_drawn(spec.plant, cables, spec.seed if seed is None else seed)
    return spec.model_copy(update=changes)


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
    return own_description(plant, own or robot, built if own is None else None, seed)
