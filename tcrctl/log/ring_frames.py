"""Frames of rings for viewers: origin in the centroid, x to node 1, z the ring's normal."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array


def _outer_map() -> Array:
    """Return the matrix (10, 16) that takes (r00, r01, ..., r22, 1) to the rows of 4 q q', q = (x, y, z, w)."""
    outer = np.zeros((4, 4, 10))
    outer[np.arange(4), np.arange(4), 9] = 1.0
    outer[3, 3, [0, 4, 8]] = 1.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        outer[i, i, [4 * i, 4 * j, 4 * k]] = 1.0, -1.0, -1.0
        outer[i, j, [3 * i + j, 3 * j + i]] = outer[j, i, [3 * i + j, 3 * j + i]] = 1.0
        outer[i, 3, [3 * k + j, 3 * j + k]] = outer[3, i, [3 * k + j, 3 * j + k]] = 1.0, -1.0
    return outer.reshape(16, 10).T


_OUTER: Final = _outer_map()
_NEXT: Final = np.array([1, 2, 0])
_LAST: Final = np.array([2, 0, 1])


def ring_frames(corners: Array) -> tuple[Array, Array]:
    """Return the poses of rings.

    Args:
        corners: Nodes 1, 2, 3 of every ring (n, 3 nodes, 3) [m], counter-clockwise seen from the normal.

    Returns:
        Centroids (n, 3) [m] and orientations as unit quaternions x, y, z, w (n, 4); NaN for a ring whose
        nodes are collinear or not finite.
    """
    with np.errstate(all="ignore"):
        centre = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0
        arm = corners[:, 0] - centre  # lies in the ring's plane
        normal = _unit(_cross(arm, corners[:, 1] - centre))
        x_axis = _unit(arm)
        axes = np.empty((len(corners), 3, 3))
        axes[:, :, 0], axes[:, :, 1], axes[:, :, 2] = x_axis, _cross(normal, x_axis), normal
        return centre, quaternions(axes)


def _cross(a: Array, b: Array) -> Array:
    """Return row-wise cross products; numpy's own cost ten times as much on so few rows."""
    product: Array = a.take(_NEXT, 1) * b.take(_LAST, 1) - a.take(_LAST, 1) * b.take(_NEXT, 1)
    return product


def _unit(a: Array) -> Array:
    unit: Array = a / np.sqrt(np.einsum("nx,nx->n", a, a))[:, None]
    return unit


def quaternions(rotation: Array) -> Array:
    """Return the unit quaternions x, y, z, w (n, 4) of rotation matrices (n, 3, 3).

    4 q q' is linear in the matrix; its row with the largest diagonal entry, normalised, is q without
    cancellation.
    """
    flat = np.ones((len(rotation), 10))
    flat[:, :9] = rotation.reshape(-1, 9)
    outer = (flat @ _OUTER).reshape(-1, 4, 4)
    largest = np.argmax(np.einsum("nii->ni", outer), axis=1)
    row = outer[np.arange(len(rotation)), largest]
    return _unit(row)


def quaternion_of_normal(normal: Array) -> Array:
    """Return the quaternion x, y, z, w (4,) of the smallest rotation from +z to the unit vector ``normal`` (3,)."""
    if normal[2] < -1.0 + 1e-12:  # half a turn: every horizontal axis will do
        return np.array([1.0, 0.0, 0.0, 0.0])
    raw = np.array([-normal[1], normal[0], 0.0, 1.0 + normal[2]])
    unit: Array = raw / np.linalg.norm(raw)
    return unit


def drawable(*arrays: NDArray[np.floating]) -> bool:
    """Tell if all numbers are finite and below 1e6 m: what is not must neither be drawn nor overflow here."""
    return all(bool((np.abs(array) < 1e6).all()) for array in arrays)
