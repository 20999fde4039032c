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
from dataclasses import dataclass

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import NoEquilibriumError
from tcrctl.robot import linear
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.equations import Workspace, assemble, make_workspace, residual
from tcrctl.robot.equilibrium import equilibrium, static_load
from tcrctl.robot.model import FIXED, Model, build_model, gravity_force, undeformed
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array

#: Relative half step of the derivative of r.
HALF_STEP = 1e-4

Describe = Callable[[Mapping[str, float]], RobotDescription]


@dataclass(frozen=True, slots=True)
class Twin:
    """The robot on either side of one parameter value, and how its rest lengths go.

    Attributes:
        below: Description with the parameter a little smaller.
        above: Description with it a little larger.
        step: Distance between the two, in the parameter's unit.
        rest_slope: dl0/dζ (m,).
    """

    below: RobotDescription
    above: RobotDescription
    step: float
    rest_slope: Array


def rest_shapes(robot: Robot, drives: Array) -> Array:
    """Node positions at rest (n, 3 n_nodes) [m] for drives (n, m) [m], each on its own way from the rest shape.

    Raises:
        NoEquilibriumError: If the robot has no stable shape there.
    """
    return np.array([equilibrium(robot.model, drive, robot.weight, robot.rest.q).q for drive in drives])


def twins(describe: Describe, robot: Robot, values: Mapping[str, float]) -> tuple[Twin, ...]:
    """Neighbours of a robot for every parameter.

    Args:
        describe: Values by path -> description.
        robot: The robot at ``values``.
        values: Parameter values by path.
    """
    found = []
    for path, value in values.items():
        half = HALF_STEP * (abs(value) or 1.0)
        below, above = (describe({**values, path: value + sign * half}) for sign in (-1.0, 1.0))
        found.append(Twin(below, above, 2.0 * half, _rest_slope(robot, below, above, 2.0 * half)))
    return tuple(found)


def shape_slopes(robot: Robot, neighbours: tuple[Twin, ...], q: Array, drive: Array) -> Array:
    """dq/dζ (3 n_nodes, n_parameters) of the equilibrium ``q`` (3 n_nodes,) at ``drive`` (m,).

    Raises:
        NoEquilibriumError: If the tangent at ``q`` is not positive definite.
    """
    rest = robot.model.cables[:, sliding_cable.REST]
    forces = []
    for twin in neighbours:
        ends = (
            (d, build_model(d, rest + sign * 0.5 * twin.step * twin.rest_slope))
            for d, sign in ((twin.below, -1.0), (twin.above, 1.0))
        )
        low, high = (_residual_at(d, model, q, drive) for d, model in ends)
        forces.append((high - low) / twin.step)
    return _answer(robot, q, drive, np.array(forces), neighbours, keep_cables=True)


def _rest_slope(robot: Robot, below: RobotDescription, above: RobotDescription, step: float) -> Array:
    """dl0/dζ (m,): zero for given rest lengths."""
    ends = [_strung_at(d, robot.rest.q) for d in (below, above)]
    if ends[0] is None or ends[1] is None:
        return np.zeros(robot.n_cables)
    zero = np.zeros(robot.n_cables)
    forces = [
        _residual_at(d, model, robot.rest.q, zero) for d, model in zip((below, above), ends, strict=True)
    ]
    force = (forces[1] - forces[0]) / step
    twin = Twin(below, above, step, zero)
    slope = _answer(robot, robot.rest.q, zero, force[None], (twin,), keep_cables=False)
    along = (ends[1].cables[:, sliding_cable.REST] - ends[0].cables[:, sliding_cable.REST]) / step
    # l0 = l(q0) EA / (EA + T): the first part at fixed q0, the second through q0
    ratio = robot.model.cables[:, sliding_cable.REST] / robot.rest.length
    ws = make_workspace(robot.model)
    residual(robot.model, robot.rest.q, zero, static_load(robot.model, robot.weight), ws)
    through: Array = ratio * (ws.G[:, 3 * FIXED :] @ _free(slope[:, 0]))
    return along + through


def _strung_at(d: RobotDescription, q: Array) -> Model | None:
    """The model whose cables carry their initial tensions in the shape ``q``; None if it gives rest lengths."""
    routes = cable_routes(d)
    tension = np.array(
        [np.nan if route.initial_tension is None else route.initial_tension for route in routes]
    )
    if np.isnan(tension).any():
        return None
    ea = np.array([route.axial_stiffness for route in routes])
    model = build_model(d, np.ones(len(routes)))
    ws = make_workspace(model)
    _residual_at(d, model, q, np.zeros(len(routes)), ws)
    return build_model(d, ws.length * ea / (ea + tension))


def _residual_at(
    d: RobotDescription, model: Model, q: Array, drive: Array, ws: Workspace | None = None
) -> Array:
    """r (12 n_modules,) [N] of the free nodes at ``q``, with the base of ``d``; fills ``ws`` if given."""
    ws = make_workspace(model) if ws is None else ws
    shape = np.concatenate([undeformed(d)[: 3 * FIXED], _free(q)])
    weight = gravity_force(model, np.array(d.gravity_m_s2, dtype=float))
    residual(model, shape, drive, static_load(model, weight), ws)
    return ws.r


def _answer(
    robot: Robot, q: Array, drive: Array, forces: Array, neighbours: Sequence[Twin], *, keep_cables: bool
) -> Array:
    """How nodes move (3 n_nodes, n) when r changes by ``forces`` (n, 12 n_modules) per unit of a parameter.

    Args:
        robot: The robot in equilibrium.
        q: Its shape.
        drive: Its drives.
        forces: ∂r/∂ζ for every neighbour.
        neighbours: For how the base moves.
        keep_cables: False: cables pull with constant tension, whatever their length.
    """
    ws = make_workspace(robot.model)
    assemble(robot.model, q, drive, static_load(robot.model, robot.weight), ws, np.bool_(True))
    if not keep_cables:
        ws.axial[:] = 0.0
    if linear.factor_shifted(ws.K, ws.U) != 0.0:
        raise NoEquilibriumError("a sensitivity (the tangent is not stable)", np.nan, 0.0, 0)
    columns = np.ascontiguousarray(-forces.T)
    linear.couple(ws, np.ascontiguousarray(forces[0]))
    linear.solve_many(ws, columns)
    base = [(undeformed(twin.above) - undeformed(twin.below))[: 3 * FIXED] / twin.step for twin in neighbours]
    return np.vstack([np.array(base).T, columns])


def _free(q: Array) -> Array:
    """The part of ``q`` (3 n_nodes,) that belongs to the free nodes."""
    return q[3 * FIXED :]
