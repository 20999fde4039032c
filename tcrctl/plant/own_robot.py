"""The robot that a simulated plant moves: not quite the one that the controller knows.

Every difference has its place on the way from the file to the robot:

    description of the plant's robot -> unlike parts -> built -> other material -> strung otherwise
"""

from __future__ import annotations

import numpy as np

from tcrctl.plant.scatter import scattered
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.robot import Robot, build_robot, hole_friction, mismatched, retensioned
from tcrctl.signals import Array


def own_description(
    settings: SimulatedSettings, description: RobotDescription, robot: Robot | None, seed: int
) -> RobotDescription:
    """Return the plant's robot with everything drawn that is drawn.

    Args:
        settings: Of the plant.
        description: The plant's robot as designed.
        robot: The same, if it is built already.
        seed: Of the run.

    Raises:
        NoEquilibriumError: If the robot as designed has no stable shape.
    """
    if settings.scatter is None:
        return description
    designed = build_robot(description) if robot is None else robot
    return scattered(description, settings.scatter, designed.model.cables[:, 0], seed)


def moving_robot(settings: SimulatedSettings, robot: Robot) -> Robot:
    """Return the robot that moves.

    Args:
        settings: Of the plant.
        robot: Built from :func:`own_description`.

    Raises:
        NoEquilibriumError: If it has no stable shape.
    """
    if settings.mismatch is not None or settings.tip_load_g:
        factors = settings.mismatch or Mismatch()
        robot = mismatched(
            robot,
            factors.springs_youngs_modulus,
            factors.cables_youngs_modulus,
            factors.density,
            settings.tip_load_g / 1000.0,
        )
    factor = 1.0 if settings.cables is None else settings.cables.initial_tension
    factor_of = np.broadcast_to(factor, robot.n_cables)
    return robot if np.all(factor_of == 1.0) else retensioned(robot, factor_of)


def friction_of(settings: SimulatedSettings, robot: Robot) -> Array | None:
    """Return friction of every hole (n_holes, 3) of a plant: its own, else the robot's; None without."""
    if settings.friction is None:
        return robot.holes
    return hole_friction(settings.friction, robot.model.first_hole)
