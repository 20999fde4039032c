"""The robot at rest: kernel arrays, strung cables, rest pose and limits, built once from a description."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements import rubbing_cable, sliding_cable
from tcrctl.robot import pose
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.equilibrium import (
    Equilibrium,
    equilibrium,
    equilibrium_with_tensions,
    with_rest_lengths,
)
from tcrctl.robot.model import Model, build_model, gravity_force, scaled, undeformed, with_load
from tcrctl.robot.module import FIXED, SIZE, ring_nodes
from tcrctl.robot.sections import FrictionSettings
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot with strung cables.

    Attributes:
        name: Name of the robot file.
        cable_names: Names of the cables in the order of the drives.
        model: Kernel arrays.
        weight: Gravity force (3 n_nodes,) [N].
        rest: Equilibrium at zero drive.
        tip: Row of the first node of the tip ring.
        stroke: Limits of the drive lengths (2,) [m].
        tension_limit: Largest tension allowed [N].
        holes: Friction of every hole (n_holes, 3), columns as in ``elements.rubbing_cable``; None without.
    """

    name: str
    cable_names: tuple[str, ...]
    model: Model
    weight: Array
    rest: Equilibrium
    tip: int
    stroke: tuple[float, float]
    tension_limit: float
    holes: Array | None = None

    def __deepcopy__(self, memo: dict[int, object]) -> Robot:
        """Return itself: nothing in it ever changes, and the kernels know its arrays as read-only."""
        del memo
        return self

    @property
    def n_modules(self) -> int:
        """Number of free modules."""
        return int(self.model.mass.shape[0])

    @property
    def n_cables(self) -> int:
        """Number of cables m."""
        return int(self.model.cables.shape[0])

    @property
    def rest_position(self) -> Array:
        """End position at rest (3,) [m]."""
        return pose.position(self.rest.q, self.tip)

    @property
    def rest_normal(self) -> Array:
        """End normal at rest (3,)."""
        return pose.normal(self.rest.q, self.tip)

    @property
    def rest_gain(self) -> Array:
        """Derivatives (7, m) of end position [m/m], normal and twist [1/m] by the drives, at rest."""
        return pose.drive_gain(self.rest.q, self.rest.gain, self.tip)


def _strung(d: RobotDescription, start: Array) -> tuple[Model, Array, Equilibrium]:
    """Find the rest lengths: given ones, or those that give every cable its tension at zero drive."""
    routes = cable_routes(d)
    no_tension = build_model(d, np.ones(len(routes)))
    length, gradient = np.zeros(len(routes)), np.zeros((len(routes), start.shape[0]))
    sliding_cable.path_gradients(
        start,
        no_tension.first_hole,
        no_tension.hole_nodes,
        no_tension.hole_weights,
        no_tension.cables,
        length,
        gradient,
    )
    model = build_model(d, length)
    weight = gravity_force(model, np.array(d.gravity_m_s2, dtype=float))
    given = np.array([np.nan if r.rest_length is None else r.rest_length for r in routes])
    wanted = np.array([0.0 if r.initial_tension is None else r.initial_tension for r in routes])
    by_tension = np.isnan(given)
    if by_tension.any():
        trial = equilibrium_with_tensions(model, np.where(by_tension, wanted, 0.0), weight, start)
        ea = model.cables[:, sliding_cable.STIFFNESS] * model.cables[:, sliding_cable.REST]
        given = np.where(by_tension, trial.length * ea / (ea + wanted), given)
        start = trial.q
    strung = with_rest_lengths(model, given)
    return strung, weight, equilibrium(strung, np.zeros(len(routes)), weight, start)


def build_robot(description: RobotDescription) -> Robot:
    """Build the robot of ``description``.

    Raises:
        NoEquilibriumError: If the robot has no stable shape at zero drive.
    """
    model, weight, rest = _strung(description, undeformed(description))
    low, high = description.stroke_mm
    return Robot(
        name=description.name,
        cable_names=tuple(route.name for route in cable_routes(description)),
        model=model,
        weight=weight,
        rest=rest,
        tip=ring_nodes(description.tip.ring)[0],
        stroke=(low / 1000.0, high / 1000.0),
        tension_limit=description.tension_limit_n,
        holes=None if description.friction is None else hole_friction(description.friction, model.first_hole),
    )


def hole_friction(friction: FrictionSettings, first_hole: NDArray[np.int64]) -> Array:
    """Return the friction of every hole (n_holes, 3), read-only, columns as in ``elements.rubbing_cable``.

    Args:
        friction: Common to all holes, or with a coefficient per cable.
        first_hole: First hole of every cable, and the end (m + 1,).
    """
    holes = np.zeros((first_hole[-1], 3))
    mu = np.broadcast_to(friction.coefficient, first_hole.shape[0] - 1)
    holes[:, rubbing_cable.COEFFICIENT] = np.repeat(mu, np.diff(first_hole))
    holes[:, rubbing_cable.LEAST_WRAP] = np.radians(friction.least_wrap_deg)
    holes[:, rubbing_cable.DRAG] = friction.drag_n
    holes.flags.writeable = False
    return holes


def retensioned(robot: Robot, factors: Array) -> Robot:
    """Return the same robot strung otherwise: every cable has its tension at zero drive times a factor (m,).

    Raises:
        NoEquilibriumError: If that robot has no stable shape at zero drive.
    """
    tension = factors * robot.rest.tension
    trial = equilibrium_with_tensions(robot.model, tension, robot.weight, robot.rest.q)
    ea = robot.model.cables[:, sliding_cable.STIFFNESS] * robot.model.cables[:, sliding_cable.REST]
    model = with_rest_lengths(robot.model, trial.length * ea / (ea + tension))
    rest = equilibrium(model, np.zeros(robot.n_cables), robot.weight, trial.q)
    return replace(robot, model=model, rest=rest)


def mismatched(
    robot: Robot, springs: float = 1.0, cables: float = 1.0, density: float = 1.0, tip_load: float = 0.0
) -> Robot:
    """Return the same robot of other material: factors on moduli and masses, same rest lengths, own rest shape.

    Args:
        robot: The robot as described.
        springs: Factor on the springs' Young's modulus.
        cables: Factor on the cables' Young's modulus.
        density: Factor on all masses.
        tip_load: Mass carried by the tip ring, spread evenly over its nodes [kg].

    Raises:
        NoEquilibriumError: If that robot has no stable shape at zero drive.
    """
    gravity = np.linalg.solve(robot.model.mass[0], robot.weight[3 * FIXED : 3 * FIXED + SIZE])[:3]
    model = with_load(scaled(robot.model, springs, cables, density), robot.tip, tip_load)
    weight = gravity_force(model, gravity)
    rest = equilibrium(model, np.zeros(robot.n_cables), weight, robot.rest.q)
    return replace(robot, model=model, weight=weight, rest=rest)
