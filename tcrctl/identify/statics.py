"""Static prediction: where the model comes to rest with given drives, and how that depends on parameters.

At rest r(q; ζ, l0) = 0, (*) of robot.equations without inertia, with the cables' rest lengths l0. So

    dq/dζ = -A^-1 (∂r/∂ζ + ∂r/∂l0 dl0/dζ)

with the analytic tangent A of the equilibrium, already factored. The derivative of r is taken at fixed q
between two models beside ζ: r is smooth there and costs nothing. Where the robot file gives initial tensions,
l0 = l(q0) EA / (EA + T), and dq0/dζ of the rest shape q0 follows the same way, from the tangent under constant
tensions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import NoEquilibriumError
from tcrctl.robot import linear
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.equations import Load, Workspace, assemble, make_workspace, residual
from tcrctl.robot.equilibrium import equilibrium, static_load, with_rest_lengths
from tcrctl.robot.model import Model, build_model, gravity_force, undeformed
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Relative half step of the derivative of r.
HALF_STEP = 1e-4

Describe = Callable[[Mapping[str, float]], RobotDescription]


class Side(NamedTuple):
    """The robot with one parameter a little smaller or larger.

    Attributes:
        model: Its arrays.
        base: Coordinates of its base nodes (12,) [m].
        load: Its weight.
    """

    model: Model
    base: Array
    load: Load


class Twins(NamedTuple):
    """The robots on either side of one parameter value, strung as the file says.

    Attributes:
        below: The parameter is a little smaller.
        above: It is a little larger.
        apart: Distance between the two, in the parameter's unit.
    """

    below: Side
    above: Side
    apart: float

    def force_slope(self, q: Array, drive: Array) -> Array:
        """Return ∂r/∂ζ (n_free,) at the shape ``q`` (3 n_nodes,) and ``drive`` (m,)."""
        low, high = (_at(side, q, drive).r for side in (self.below, self.above))
        slope: Array = (high - low) / self.apart
        return slope

    @property
    def base_slope(self) -> Array:
        """How the base moves (12,)."""
        return (self.above.base - self.below.base) / self.apart


def rest_shapes(robot: Robot, drives: Array) -> Array:
    """Find node positions at rest (n, 3 n_nodes) [m] for drives (n, m) [m], each straight from the rest shape.

    Raises:
        NoEquilibriumError: If the robot has no stable shape there.
    """
    return np.array([equilibrium(robot.model, drive, robot.weight, robot.rest.q).q for drive in drives])


def shape_slopes(robot: Robot, twins: Sequence[Twins], q: Array, drive: Array) -> Array:
    """Return dq/dζ (3 n_nodes, n_parameters) of the equilibrium ``q`` (3 n_nodes,) at ``drive`` (m,).

    Raises:
        NoEquilibriumError: If the tangent at ``q`` is not positive definite.
    """
    return _moved(robot, twins, q, drive, keep_cables=True)


def make_twins(describe: Describe, robot: Robot, values: Mapping[str, float]) -> tuple[Twins, ...]:
    """Return the neighbours of a robot for every parameter.

    Args:
        describe: Values by path -> description.
        robot: The robot at ``values``.
        values: Parameter values by path.

    Raises:
        NoEquilibriumError: If the rest shape is not stable under constant tensions.
    """
    found = []
    for path, value in values.items():
        half = HALF_STEP * (abs(value) or 1.0)
        below, above = (describe({**values, path: value + sign * half}) for sign in (-1.0, 1.0))
        found.append(_twins(robot, below, above, half))
    return tuple(found)


def _twins(robot: Robot, below: RobotDescription, above: RobotDescription, half: float) -> Twins:
    """Return the neighbours with the rest lengths that they would be given, to first order."""
    if any(route.initial_tension is None for route in cable_routes(below)):
        rest = robot.model.cables[:, sliding_cable.REST]
        return Twins(_side(below, rest), _side(above, rest), 2.0 * half)
    low, high = (_side(d, _lengths_under_tension(d, robot.rest.q)) for d in (below, above))
    zero = np.zeros(robot.n_cables)
    moved = _moved(robot, [Twins(low, high, 2.0 * half)], robot.rest.q, zero, keep_cables=False)
    # l0 = l(q0) EA / (EA + T): through T, EA and the geometry at fixed q0, and through q0
    ratio = robot.model.cables[:, sliding_cable.REST] / robot.rest.length
    gradient = _at(Side(robot.model, robot.rest.q[: 3 * FIXED], low.load), robot.rest.q, zero).G
    change = half * ratio * (gradient[:, 3 * FIXED :] @ _free(moved[:, 0]))
    return Twins(
        low._replace(model=with_rest_lengths(low.model, low.model.cables[:, sliding_cable.REST] - change)),
        high._replace(model=with_rest_lengths(high.model, high.model.cables[:, sliding_cable.REST] + change)),
        2.0 * half,
    )


def _side(d: RobotDescription, rest: Array) -> Side:
    model = build_model(d, rest)
    weight = gravity_force(model, np.array(d.gravity_m_s2, dtype=float))
    return Side(model, undeformed(d)[: 3 * FIXED], static_load(model, weight))


def _lengths_under_tension(d: RobotDescription, q: Array) -> Array:
    """Rest lengths (m,) [m] with which the cables carry their initial tensions in the shape ``q``."""
    routes = cable_routes(d)
    ea = np.array([route.axial_stiffness for route in routes])
    tension = np.array([route.initial_tension for route in routes], dtype=float)
    length: Array = _at(_side(d, np.ones(len(routes))), q, np.zeros(len(routes))).length
    rest: Array = length * ea / (ea + tension)
    return rest


def _at(side: Side, q: Array, drive: Array) -> Workspace:
    """Return the residual, cable gradients and lengths with the free nodes as in ``q``."""
    ws = make_workspace(side.model)
    residual(side.model, np.concatenate([side.base, _free(q)]), drive, side.load, ws)
    return ws


def _moved(robot: Robot, twins: Sequence[Twins], q: Array, drive: Array, *, keep_cables: bool) -> Array:
    """Return dq/dζ (3 n_nodes, n): A^-1 applied to -∂r/∂ζ.

    Args:
        robot: The robot in equilibrium.
        twins: Its neighbours.
        q: Its shape (3 n_nodes,) [m].
        drive: Its drives (m,) [m].
        keep_cables: False: cables pull with constant tension, whatever their length.
    """
    ws = make_workspace(robot.model)
    assemble(robot.model, q, drive, static_load(robot.model, robot.weight), ws, np.bool_(True))
    if not keep_cables:
        ws.axial[:] = 0.0
    if linear.factor_shifted(ws.K, ws.U) != 0.0:
        raise NoEquilibriumError("a sensitivity (the tangent is not stable)", np.nan, 0.0, 0)
    columns = np.ascontiguousarray(-np.array([pair.force_slope(q, drive) for pair in twins]).T)
    linear.couple(ws, ws.r)
    linear.solve_many(ws, columns)
    return np.vstack([np.array([pair.base_slope for pair in twins]).T, columns])


def _free(q: Array) -> Array:
    """Return the part of ``q`` (3 n_nodes,) that belongs to the free nodes."""
    return q[3 * FIXED :]
