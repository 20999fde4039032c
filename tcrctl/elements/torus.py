"""Torus (ring) element of three nodes at the corners of its inscribed regular triangle, (1)-(5).

Any point of the ring is a fixed linear combination of the three nodes, (2), so holes for cables need no
further coordinates; the mass matrix is constant and isotropic, (4); the stiffness is that of three virtual
rods along the triangle's sides, (5), which are ordinary bars.
"""

from __future__ import annotations

import math

import numpy as np

from tcrctl.signals import Array

TURN_THIRD = 2.0 * math.pi / 3.0


def point_weights(angle: float) -> Array:
    """Return the weights (3,) of the ring's nodes for the point at ``angle`` [rad] counter-clockwise from node 1.

    (2) with n_i = r_i - r_o and r_o = (r_1 + r_2 + r_3) / 3 multiplied out; angles θ - 2π/3 and θ - 4π/3
    because the nodes are numbered counter-clockwise (REFERENCES.md, correction 1). The weights sum to 1.
    """
    cosines = np.array([math.cos(angle - k * TURN_THIRD) for k in range(3)])
    weights = 2.0 / 3.0 * cosines + 1.0 / 3.0
    weights[np.abs(weights) < 1e-15] = 0.0
    return weights


def node_mass(mass: float) -> float:
    """Return the mass [kg] of each node of a ring of ``mass`` [kg]: M_s = (2π/3) ρ b I_9 = mass / 3 I_9, (4)."""
    return mass / 3.0


def sides(nodes: tuple[int, int, int]) -> list[tuple[int, int]]:
    """Return the three virtual rods of (5) as pairs of node numbers."""
    return [(nodes[0], nodes[1]), (nodes[1], nodes[2]), (nodes[2], nodes[0])]
