"""What is loose each time a robot comes to rest: the tension that its holes hold back, the play of its drives.

A hole that holds back makes the tension beyond it larger or smaller by F: the ring nodes feel F ∂l/∂q, with the
length l of the cable beyond that hole. A cable that its drive has just pulled has less tension beyond every hole.
"""

from __future__ import annotations

import numpy as np

from tcrctl.robot.model import Model
from tcrctl.signals import Array


def hole_forces(model: Model, q: Array) -> tuple[Array, Array]:
    """Return forces on the nodes and wrap angles.

    Args:
        model: Robot arrays.
        q: Node positions (3 n_nodes,) [m].

    Returns:
        ∂l/∂q of the cable beyond every hole but the last of its cable (n_loose, 3 n_nodes), and the angle by which
        the cable turns there (n_loose,) [rad].
    """
    points = np.einsum("hk,hkx->hx", model.hole_weights, q.reshape(-1, 3)[model.hole_nodes])
    forces, angles = [], []
    for first, end in zip(model.first_hole[:-1], model.first_hole[1:], strict=True):
        way = np.diff(points[first:end], axis=0)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        beyond, found = np.zeros((q.size // 3, 3)), []
        for k in range(way.shape[0] - 1, -1, -1):
            for hole, sign in ((first + k + 1, 1.0), (first + k, -1.0)):
                weights = model.hole_weights[hole][:, None]
                np.add.at(beyond, model.hole_nodes[hole], sign * weights * way[k])
            found.append(beyond.ravel().copy())
        forces += found[::-1]
        cosines = np.einsum("ij,ij->i", way[1:], way[:-1])
        angles += [0.0, *np.arccos(np.clip(cosines, -1.0, 1.0))]
    return np.array(forces), np.array(angles)


def holes_of_cables(model: Model) -> Array:
    """Return the cable of every hole but the last of its cable (n_loose,)."""
    counts = np.diff(model.first_hole) - 1
    return np.repeat(np.arange(counts.size), counts)
