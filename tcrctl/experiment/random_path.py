"""Random pose paths that a robot can follow: does a controller hold where nobody tuned it?

A path goes through two to four poses of the nominal robot at rest with random drives, straight and with the normal
on a great circle. A path that the feasibility check refuses, for the nominal robot or for the plant, whose weaker
springs cannot hold every pose with taut cables, is drawn again and counted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from tcrctl.errors import InfeasibleError, InputError, NoEquilibriumError
from tcrctl.experiment.feasibility import DriveLimits, check_feasibility
from tcrctl.experiment.prepare import Experiment, build_plant, plan, prepare
from tcrctl.experiment.spec import LoadedSpec
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array
from tcrctl.trajectory.pose_settings import WaypointSettings, WaypointsSettings

#: Duration of a path [s].
SHORTEST_S, LONGEST_S = 20.0, 60.0
#: Tensions of the nominal robot at a waypoint [N]; the weaker springs of the plant need some room.
TENSIONS: Final = (2.0, 30.0)
#: What the plant must be able to do along the whole path: the limits that the feasibility check has for the model.
LIMITS: Final = DriveLimits(speed=0.05, floor=1.0, ceiling=60.0)


def random_path(loaded: LoadedSpec, seed: int) -> tuple[Experiment, int]:
    """Draw paths until one is feasible and of the right duration.

    Args:
        loaded: An experiment with output ``pose`` on a robot with two segments; its trajectory is replaced.
        seed: Of the path and of everything else that is random.

    Returns:
        The experiment along the path, and how many were refused.

    Raises:
        InputError: If the robot has not two segments of three cables each.
    """
    random = np.random.default_rng(seed)
    robot = build_robot(loaded.robot)
    refused = 0
    if robot.n_cables != 6:
        raise InputError(f"random paths need a robot with six cables; {robot.name} has {robot.n_cables}")
    while True:
        spec = loaded.spec.model_copy(update={"trajectory": _path(random, robot)})
        experiment = prepare(replace(loaded, spec=spec), seed=seed)
        if not SHORTEST_S <= experiment.trajectory.duration <= LONGEST_S:
            continue
        try:
            plan(experiment)
            plant, _ = build_plant(experiment)
            assert isinstance(plant, SimulatedPlant)  # studies simulate
            check_feasibility(experiment.trajectory, plant.robot, LIMITS)
        except InfeasibleError:
            refused += 1
            continue
        return experiment, refused


def _path(random: np.random.Generator, robot: Robot) -> WaypointsSettings:
    """Return the waypoints and limits of the motion."""
    return WaypointsSettings(
        kind="waypoints",
        points=tuple(_pose(random, robot) for _ in range(random.integers(2, 5))),
        speed_limit_mm_s=random.uniform(10.0, 40.0),
        acceleration_limit_mm_s2=random.uniform(10.0, 30.0),
        angular_speed_limit_deg_s=random.uniform(4.0, 12.0),
        angular_acceleration_limit_deg_s2=random.uniform(4.0, 10.0),
        ramp_s=random.uniform(1.5, 3.0),
        settle_s=3.0,
    )


def _pose(random: np.random.Generator, robot: Robot) -> WaypointSettings:
    """Draw a pose that the nominal robot takes at rest with all cables taut."""
    while True:
        try:
            held = equilibrium(robot.model, _drives(random), robot.weight, robot.rest.q)
        except NoEquilibriumError:
            continue
        if TENSIONS[0] <= held.tension.min() and held.tension.max() <= TENSIONS[1]:
            offset = 1e3 * (pose.position(held.q, robot.tip) - robot.rest_position)
            normal = pose.normal(held.q, robot.tip)
            return WaypointSettings(offset_mm=tuple(offset.tolist()), normal=tuple(normal.tolist()))


def _drives(random: np.random.Generator) -> Array:
    """Draw drive lengths (6,) [m]: shortening, bending of the whole robot, bending of its upper segment."""
    lower = np.arange(6) % 2 == 0
    short = random.uniform(0.0, 0.035)
    angles = np.radians(60.0 * np.arange(6))
    whole, upper = random.uniform(0.0, 0.05), random.uniform(0.0, 0.03)
    bend = np.where(lower, whole, 0.6 * whole) * np.cos(angles - random.uniform(0.0, 2 * np.pi))
    bend += np.where(lower, 0.0, upper) * np.cos(angles - random.uniform(0.0, 2 * np.pi))
    drives: Array = np.where(lower, short, 0.6 * short) + bend
    return drives
