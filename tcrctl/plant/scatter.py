"""A robot as it came out of the workshop: no two modules, springs and holes are alike.

What is drawn is written into the description of a robot (``modules.each``, ``springs.each``, ``through``,
``base``), so that it can be read, logged and used again as a robot file. Rest lengths are kept.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcrctl.plant.reality_settings import ScatterSettings
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.module import LABELS, ModuleDifference
from tcrctl.robot.sections import FreeRoute, Hole, SpringBetween
from tcrctl.signals import Array

#: Relative deviations are cut off here, so that nothing gets a negative stiffness or mass.
LARGEST = 0.9


def scattered(robot: RobotDescription, scatter: ScatterSettings, rest: Array, seed: int) -> RobotDescription:
    """Draw a robot.

    Args:
        robot: The robot as designed.
        scatter: How much its parts differ.
        rest: Rest lengths of its cables (m,) [m].
        seed: Of the draw, unless ``scatter`` has one.
    """
    seed = seed if scatter.seed is None else scatter.seed
    masses, geometry, springs, holes, tilt = (
        np.random.default_rng(part) for part in np.random.SeedSequence(seed).spawn(5)
    )
    return robot.model_copy(
        update={
            "modules": robot.modules.model_copy(update={"each": _modules(robot, scatter, masses, geometry)}),
            "springs": robot.springs.model_copy(update={"each": _springs(robot, scatter, springs)}),
            "cables": robot.cables.model_copy(
                update={"initial_tension_n": None, "routes": _routes(robot, scatter, rest, holes)}
            ),
            "base": robot.base.model_copy(update={"tilt_deg": _tilt(robot, scatter, tilt)}),
        }
    )


def _factor(random: np.random.Generator, deviation: float) -> float:
    return 1.0 + float(np.clip(deviation * random.standard_normal(), -LARGEST, LARGEST))


def _modules(
    robot: RobotDescription,
    scatter: ScatterSettings,
    masses: np.random.Generator,
    geometry: np.random.Generator,
) -> tuple[ModuleDifference, ...]:
    """Return the mass and node places of every module."""
    given = {entry.module: entry for entry in robot.modules.each}
    drawn = []
    for module in range(1, robot.modules.count + 1):
        entry = given.get(module, ModuleDifference(module=module))
        moved = scatter.geometry_mm * geometry.standard_normal((len(LABELS), 3))
        offsets: dict[Any, Any] = {
            label: tuple((np.array(entry.offsets_mm.get(label, (0.0, 0.0, 0.0))) + by).tolist())  # type: ignore[call-overload]
            for label, by in zip(LABELS, moved, strict=True)
        }
        mass = robot.modules.of(module).mass_g * _factor(masses, scatter.masses)
        drawn.append(entry.model_copy(update={"mass_g": mass, "offsets_mm": offsets}))
    return tuple(drawn)


def _springs(
    robot: RobotDescription, scatter: ScatterSettings, random: np.random.Generator
) -> tuple[SpringBetween, ...]:
    """Draw every spring's Young's modulus: those of a joint deviate together, and each a little on its own."""
    given = {frozenset(entry.nodes): entry for entry in robot.springs.each}
    per_joint, joints = len(robot.springs.joint), robot.modules.count
    drawn, common = [], 1.0
    for i, spring in enumerate(robot.springs.entries(joints)):
        if i >= per_joint * joints or i % per_joint == 0:
            common = _factor(random, scatter.springs)
        entry = given.get(frozenset(spring.nodes), SpringBetween(nodes=spring.nodes))
        said = entry.youngs_modulus_mpa or spring.youngs_modulus_mpa or robot.springs.youngs_modulus_mpa
        modulus = said * common * _factor(random, scatter.single_springs)
        drawn.append(entry.model_copy(update={"youngs_modulus_mpa": modulus}))
    return tuple(drawn)


def _routes(
    robot: RobotDescription, scatter: ScatterSettings, rest: Array, random: np.random.Generator
) -> tuple[FreeRoute, ...]:
    """Return the angle of every hole; cables have the rest lengths of the robot as designed."""
    drawn = []
    for route, length in zip(cable_routes(robot), rest.tolist(), strict=True):
        moved = scatter.holes_deg * random.standard_normal(len(route.holes))
        holes = tuple(
            Hole(ring=ring, hole_deg=math.remainder(math.degrees(angle) + by, 360.0))
            for (ring, angle), by in zip(route.holes, moved.tolist(), strict=True)
        )
        drawn.append(FreeRoute(name=route.name, through=holes, rest_length_mm=1000.0 * length))
    return tuple(drawn)


def _tilt(
    robot: RobotDescription, scatter: ScatterSettings, random: np.random.Generator
) -> tuple[float, float]:
    """Draw the turns of the base about x and y [deg]."""
    direction = random.uniform(0.0, 2.0 * math.pi)
    x, y = robot.base.tilt_deg
    return x + scatter.tilt_deg * math.cos(direction), y + scatter.tilt_deg * math.sin(direction)
