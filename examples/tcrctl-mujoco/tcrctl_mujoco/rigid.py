"""A module of the robot as one rigid body: where its nodes are in it, and its mass, centre and inertia.

tcrctl knows a module as four nodes with a consistent mass matrix and stiff rods between them. The rods are so stiff
that they change their length by some micrometres; here they do not at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcrctl.extend import Array, Robot

#: Nodes of a module; the fixed base is the first.
NODES = 4


@dataclass(frozen=True, slots=True)
class RigidModule:
    """A module in its own frame, which is parallel to the world's in the rest pose.

    Attributes:
        origin: Where the frame is at rest, the centroid of the ring (3,) [m].
        nodes: Nodes in the frame (4, 3) [m].
        mass: Mass [kg].
        centre: Centre of mass in the frame (3,) [m].
        inertia: Inertia about the centre of mass (3, 3) [kg m2].
    """

    origin: Array
    nodes: Array
    mass: float
    centre: Array
    inertia: Array


def rigid_modules(robot: Robot) -> list[RigidModule]:
    """Return all free modules, from the base down, in the shape that they have at rest."""
    rest = robot.rest.q.reshape(-1, NODES, 3)
    return [_rigid(nodes, block[::3, ::3]) for nodes, block in zip(rest[1:], robot.model.mass, strict=True)]


def _rigid(nodes: Array, weights: Array) -> RigidModule:
    """Make one body of nodes (4, 3) [m] whose kinetic energy is sum_ij w_ij v_i . v_j / 2, weights (4, 4) [kg]."""
    origin = nodes[:3].mean(axis=0)
    local = nodes - origin
    mass = float(weights.sum())
    centre = weights.sum(axis=0) @ local / mass
    arms = local - centre
    products = np.einsum("ij,ia,jb->ab", weights, arms, arms)
    inertia = np.trace(products) * np.eye(3) - products
    return RigidModule(origin, local, mass, centre, inertia)
