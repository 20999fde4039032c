"""Axes of every ring, which turn with it: x from its first node to its second, z its normal."""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.copies import copy_vector
from tcrctl.numerics.kernel import part
from tcrctl.numerics.rotation import cross, norm
from tcrctl.robot.module import RING
from tcrctl.signals import Array


def ring_frames(nodes: Array) -> Array:
    """Return the axes of every ring (n_rings, 3, 3), one per row, from its nodes (3 n_rings, 3)."""
    rings = nodes.reshape(-1, RING, 3)
    x = rings[:, 1] - rings[:, 0]
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = np.cross(x, rings[:, 2] - rings[:, 0])
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=1)


@part(error_model="numpy")
def axes_of(ring: Array) -> Array:
    """Return those of one ring (3, 3), one per row, from its nodes (3, 3), in a kernel; NaN if it has none."""
    side, other = np.empty(3), np.empty(3)
    for i in range(3):  # element by element, in all kernels of one picture: half a second to compile less
        side[i], other[i] = ring[1, i] - ring[0, i], ring[2, i] - ring[0, i]
    normal, axes = cross(side, other), np.empty((3, 3))
    width, area = norm(side), norm(normal)
    for i in range(3):
        axes[0, i], axes[2, i] = side[i] / width, normal[i] / area
    copy_vector(cross(axes[2], axes[0]), axes[1])
    return axes


@part()
def centre_of(ring: Array) -> Array:
    """Return the centre of one ring (3,) [m] from its nodes (3, 3)."""
    centre = np.empty(3)
    for i in range(3):
        centre[i] = (ring[0, i] + ring[1, i] + ring[2, i]) / RING
    return centre
