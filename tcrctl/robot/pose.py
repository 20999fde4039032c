"""End pose of a configuration, (11): centroid and unit normal of a ring, and their derivatives."""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array


@kernel(error_model="numpy")
def position(q: Array, ring: int) -> Array:
    """Return the centroid (3,) [m] of the ring whose first node is row ``ring`` of ``q`` (3 n_nodes,)."""
    y = np.zeros(3)
    for node in range(ring, ring + 3):
        for a in range(3):
            y[a] += q[3 * node + a] / 3.0
    return y


@part(error_model="numpy")
def _area_vector(q: Array, ring: int) -> Array:
    """Return (r2 - r1) x (r3 - r2) (3,) [m2]: +z at rest for nodes counter-clockwise seen from +z."""
    a, b, c = 3 * ring, 3 * ring + 3, 3 * ring + 6
    d = np.empty(3)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        d[k] = (q[b + i] - q[a + i]) * (q[c + j] - q[b + j]) - (q[b + j] - q[a + j]) * (q[c + i] - q[b + i])
    return d


@kernel(error_model="numpy")
def normal(q: Array, ring: int) -> Array:
    """Return the unit normal (3,) of the ring, +z at rest (REFERENCES.md, correction 6)."""
    d = _area_vector(q, ring)
    size = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    n: Array = d / size
    return n


@kernel(error_model="numpy")
def twist(q: Array, ring: int) -> float:
    """Return rotation [rad] of the ring about its normal against the shortest rotation from rest (node 1 on +x)."""
    n, y = normal(q, ring), position(q, ring)
    arm, ahead = np.empty(3), np.empty(3)
    for a in range(3):
        arm[a] = q[3 * ring + a] - y[a]
    # shortest rotation of e_x that takes e_z to n: Rodrigues with axis e_z x n
    scale = n[0] / (1.0 + n[2])
    ahead[0], ahead[1], ahead[2] = 1.0 - scale * n[0], -scale * n[1], -n[0]
    along, across = 0.0, 0.0
    for a in range(3):
        i, j = (a + 1) % 3, (a + 2) % 3
        along += ahead[a] * arm[a]
        across += n[a] * (ahead[i] * arm[j] - ahead[j] * arm[i])
    return float(np.arctan2(across, along))


@kernel(error_model="numpy")
def output_matrix(q: Array, ring: int) -> Array:
    """Return derivatives (7, 9) of position, normal and twist with respect to the ring's nine coordinates.

    Rows 0-2: ∂y/∂q = I/3 per node. Rows 3-5: with d = Σ_k r_k x r_{k+1} (twice the area vector's value for a
    triangle), δn = (I - n n') δd / |d|. Row 6: rotation about the normal, the mean of the nodes' tangential
    displacements over their distance to the centroid [rad/m].
    """
    n, y = normal(q, ring), position(q, ring)
    d = _area_vector(q, ring)
    size = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    C = np.zeros((7, 9))
    for node in range(3):
        following, before = 3 * (ring + (node + 1) % 3), 3 * (ring + (node + 2) % 3)
        arm, tangent = np.empty(3), np.empty(3)
        for a in range(3):
            arm[a] = q[3 * (ring + node) + a] - y[a]
        radius2 = arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2
        for a in range(3):
            i, j = (a + 1) % 3, (a + 2) % 3
            tangent[a] = n[i] * arm[j] - n[j] * arm[i]
        for b in range(3):
            i, j = (b + 1) % 3, (b + 2) % 3
            column = 3 * node + b
            C[b, column] = 1.0 / 3.0
            C[6, column] = tangent[b] / (3.0 * radius2)
            # d(r_k x r_{k+1} + r_{k-1} x r_k) = e_b x (r_{k+1} - r_{k-1}) for a displacement along e_b
            change = np.zeros(3)
            change[i] = -(q[following + j] - q[before + j])
            change[j] = q[following + i] - q[before + i]
            along = n[0] * change[0] + n[1] * change[1] + n[2] * change[2]
            for a in range(3):
                C[3 + a, column] = (change[a] - n[a] * along) / size
    return C


@kernel(error_model="numpy")
def drive_gain(q: Array, gain: Array, ring: int) -> Array:
    """Return derivatives (7, m) of position, normal and twist of a ring by the drives.

    Args:
        q: Node positions (3 n_nodes,) [m].
        gain: Derivatives of the free coordinates by the drives (n_free, m).
        ring: Row of the ring's first node, not that of the base.
    """
    first = 3 * (ring - FIXED)
    moved: Array = np.dot(output_matrix(q, ring), gain[first : first + 9])
    return moved
