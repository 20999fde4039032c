"""Sliding cable through n holes, driven at one end, anchored at the other; frictionless and massless.

Each hole is a point of a ring, p_i = Σ_j w_ij r_j (torus.point_weights). With the path length
l(q) = lead + Σ_i |p_{i+1} - p_i|, the drive d (length taken in) and the rest length l0 the cable obeys

    λ = T = max(0, k (l(q) + d - l0) + c (dl/dt + u)),    k = EA / l0,    u = dd/dt

which is the driving constraint Φ of (6)-(8) and (20) with the massless actuation node eliminated: Φ_q' λ in
(9) becomes T ∂l/∂q. T is the same along the path, so ∂l/∂p_i is the difference of two unit vectors and
∂²l/∂q² is block banded and positive semidefinite (l is convex), with (I - e e') / length per segment. An
implicit rule gives dl/dt + u = w (l + d - before); then T is the derivative of T² / (2 (k + c w)).
"""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array

#: Columns of the cable parameters (m, 4): l0 with lead [m], EA / l0 [N/m], damping [N s/m], lead [m].
REST, STIFFNESS, DAMPING, LEAD = range(4)


@part(error_model="numpy")
def hole_position(q: Array, nodes: np.ndarray, weights: Array, hole: int) -> tuple[float, float, float]:
    """Return the position of ``hole`` [m]; nodes (n_holes, 3) and weights (n_holes, 3)."""
    a, b, c = 3 * nodes[hole, 0], 3 * nodes[hole, 1], 3 * nodes[hole, 2]
    wa, wb, wc = weights[hole, 0], weights[hole, 1], weights[hole, 2]
    return (
        wa * q[a] + wb * q[b] + wc * q[c],
        wa * q[a + 1] + wb * q[b + 1] + wc * q[c + 1],
        wa * q[a + 2] + wb * q[b + 2] + wc * q[c + 2],
    )


@part(error_model="numpy")
def segment(q: Array, nodes: np.ndarray, weights: Array, hole: int) -> tuple[float, float, float, float]:
    """Return the length [m] and direction of the segment from ``hole`` to the next one."""
    x0, y0, z0 = hole_position(q, nodes, weights, hole)
    x1, y1, z1 = hole_position(q, nodes, weights, hole + 1)
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    return length, dx / length, dy / length, dz / length


@part(error_model="numpy")
def spread(
    G: Array, c: int, nodes: np.ndarray, weights: Array, hole: int, x: float, y: float, z: float
) -> None:
    """Add the derivative (x, y, z) with respect to ``hole`` to row ``c`` of G (m, 3 n_nodes)."""
    for i in range(3):
        weight = weights[hole, i]
        if weight != 0.0:
            node = 3 * nodes[hole, i]
            G[c, node] += weight * x
            G[c, node + 1] += weight * y
            G[c, node + 2] += weight * z


@kernel(error_model="numpy")
def path_gradients(
    q: Array,
    first_hole: np.ndarray,
    nodes: np.ndarray,
    weights: Array,
    cables: Array,
    length: Array,
    G: Array,
) -> None:
    """Fill path lengths (m,) [m] and G = ∂l/∂q (m, 3 n_nodes).

    Holes of cable c are first_hole[c] .. first_hole[c + 1] - 1; ``cables`` (m, 4) as in the column names.
    """
    for c in range(G.shape[0]):
        for k in range(G.shape[1]):
            G[c, k] = 0.0
    for c in range(cables.shape[0]):
        length[c] = cables[c, LEAD]
        for hole in range(first_hole[c], first_hole[c + 1] - 1):
            stretch, ex, ey, ez = segment(q, nodes, weights, hole)
            length[c] += stretch
            spread(G, c, nodes, weights, hole, -ex, -ey, -ez)
            spread(G, c, nodes, weights, hole + 1, ex, ey, ez)


@part(error_model="numpy")
def tension(total: float, w: float, before: float, cables: Array, c: int) -> float:
    """Return λ = T [N] >= 0 of cable ``c`` at ``total`` = l + d [m] with dl/dt + u = w (total - before)."""
    T = cables[c, STIFFNESS] * (total - cables[c, REST]) + cables[c, DAMPING] * w * (total - before)
    return float(max(T, 0.0))
