"""End displacements of Table II of [TCR]: measured, and by the static model with the same drives."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.module import apexes
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Measured end position before driving [mm], frame of the paper.
INITIAL_MM: Final = (62.33, -160.89, 380.19)
#: Drive lengths and measured end position of every configuration [mm].
CONFIGURATIONS: Final = {
    "bending": ((90.0, 50.0, 50.0, 50.0, 50.0, 50.0), (73.75, -261.71, 466.62)),
    "contraction": ((90.0, 70.0, 90.0, 70.0, 90.0, 70.0), (63.14, -159.63, 471.19)),
    "s_shape": ((60.0, 25.0, 55.0, 85.0, 55.0, 25.0), (49.88, 29.85, 506.55)),
}
#: The paper does not give its frame. Fitted: cable 1 lies in this direction, and the cables are numbered clockwise.
CABLE_1_DEG: Final = -85.7


def measured_displacements() -> dict[str, Array]:
    """End displacement (3,) [m] of every configuration as measured, in the robot's world frame."""
    turn = math.radians(CABLE_1_DEG)
    # the paper's frame is the robot's, mirrored at its x axis and turned; both steps are undone
    back = np.array(
        [[math.cos(turn), math.sin(turn), 0.0], [math.sin(turn), -math.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    return {
        name: 1e-3 * back @ np.subtract(position, INITIAL_MM)
        for name, (_, position) in CONFIGURATIONS.items()
    }


def model_displacements(robot: Robot) -> dict[str, Array]:
    """End displacement (3,) [m] of every configuration by statics.

    The endpoint of the table is the last apex.

    Args:
        robot: Two-segment robot with six cables.
    """
    found, rest = {}, _endpoint(robot, robot.rest.q)
    for name, (drives, _) in CONFIGURATIONS.items():
        shape = equilibrium(
            robot.model, 1e-3 * np.array(drives), robot.weight, robot.rest.q, np.zeros(robot.n_cables)
        )
        found[name] = _endpoint(robot, shape.q) - rest
    return found


def _endpoint(robot: Robot, q: Array) -> Array:
    last: Array = apexes(q)[robot.n_modules]
    return last
