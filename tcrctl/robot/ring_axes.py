"""Axes of every ring, which turn with it: x from its first node to its second, z its normal."""

from __future__ import annotations

import numpy as np

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


@part()
def axes_of(ring: Array) -> Array:
    """Return those of one ring (3, 3), one per row, from its nodes (3, 3), in a kernel; NaN if it has none."""
    side = ring[1] - ring[0]
    normal = cross(side, ring[2] - ring[0])
    axes = np.empty((3, 3))
    axes[0] = side / norm(side)
    axes[2] = normal / norm(normal)
    axes[1] = cross(axes[2], axes[0])
    return axes


@part()
def centre_of(ring: Array) -> Array:
    """Return the centre of one ring (3,) [m] from its nodes (3, 3)."""
    centre: Array = (ring[0] + ring[1] + ring[2]) / RING
    return centre
