"""Drag of dithered holes: what is left of the friction of cables that are moved to and fro all the time.

A cable slips through hole h at the rate s_h' = (1 - ξ_h) u + p_h' v, with the drive speed u, the path x_h from the
actuator to the hole, ξ_h = x_h / l, and p_h = ∂x_h/∂q - ξ_h ∂l/∂q: what a stretched cable gives way on both sides of
the hole is left out. Friction F_h = T (exp(μ θ_h) - 1) whose sign turns with a dither of amplitude A, and needs the
time τ for every turn, holds against the mean slip with c_h s_h', c_h = F_h τ / A, so that

    M v' + ... = - Σ_h c_h p_h ((1 - ξ_h) u + p_h' v)

which takes energy out of any motion. See docs/control.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.elements.rubbing_cable import COEFFICIENT, DRAG, LEAST_WRAP
from tcrctl.elements.sliding_cable import LEAD, segment, spread
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array


class HoleDrag(NamedTuple):
    """Drag of all holes, changed in place; rows of anchors are zero.

    Attributes:
        coefficient: c_h (n_holes,) [N s/m].
        path: p_h (n_holes, 12 n_modules).
        through: 1 - ξ_h (n_holes,).
    """

    coefficient: Array
    path: Array
    through: Array


def no_drag(model: Model) -> HoleDrag:
    """Return drag of none of a robot's holes."""
    n = model.hole_nodes.shape[0]
    return HoleDrag(np.zeros(n), np.zeros((n, 12 * model.mass.shape[0])), np.zeros(n))


@njit(cache=True, error_model="numpy")
def fill_hole_drag(
    model: Model, q: Array, G: Array, tension: Array, friction: Array, turn: float, drag: HoleDrag
) -> None:
    """Fill the drag of all holes.

    Args:
        model: Robot arrays.
        q: Node positions (3 n_nodes,) [m].
        G: ∂l/∂q there (m, 3 n_nodes).
        tension: Of the cables (m,) [N].
        friction: Of every hole (n_holes, 3), columns as in ``elements.rubbing_cable``.
        turn: τ / A [s/m].
        drag: Filled.
    """
    nodes, weights = model.hole_nodes, model.hole_weights
    row = np.zeros((1, q.shape[0]))
    for c in range(model.cables.shape[0]):
        first, last = model.first_hole[c], model.first_hole[c + 1] - 1
        total = model.cables[c, LEAD]
        for h in range(first, last):
            total += segment(q, nodes, weights, h)[0]
        row[:] = 0.0
        x, bx, by, bz = model.cables[c, LEAD], 0.0, 0.0, 0.0
        for h in range(first, last):
            length, ex, ey, ez = segment(q, nodes, weights, h)
            wrap = friction[h, LEAST_WRAP]
            if h > first:
                wrap = max(np.arccos(min(bx * ex + by * ey + bz * ez, 1.0)), wrap)
            ratio = x / total
            held = friction[h, DRAG] + max(tension[c], 0.0) * np.expm1(friction[h, COEFFICIENT] * wrap)
            drag.coefficient[h], drag.through[h] = turn * held, 1.0 - ratio
            for k in range(drag.path.shape[1]):
                drag.path[h, k] = row[0, 3 * FIXED + k] - ratio * G[c, 3 * FIXED + k]
            spread(row, 0, nodes, weights, h, -ex, -ey, -ez)
            spread(row, 0, nodes, weights, h + 1, ex, ey, ez)
            x, bx, by, bz = x + length, ex, ey, ez


@njit(cache=True, error_model="numpy")
def drag_force(model: Model, drag: HoleDrag, v: Array, speed: Array, force: Array) -> None:
    """Add the drag on the robot's free nodes at the rates v (3 n_nodes,), speed (m,) [m/s] to force (12 n_modules,) [N]."""
    for c in range(model.cables.shape[0]):
        for h in range(model.first_hole[c], model.first_hole[c + 1] - 1):
            if drag.coefficient[h] > 0.0:
                slip = drag.through[h] * speed[c]
                for k in range(force.shape[0]):
                    slip += drag.path[h, k] * v[3 * FIXED + k]
                for k in range(force.shape[0]):
                    force[k] -= drag.coefficient[h] * slip * drag.path[h, k]


@njit(cache=True, error_model="numpy")
def project_drag(model: Model, drag: HoleDrag, V: Array, D: Array, F: Array) -> None:
    """Fill the reduced drag matrix D (r, r), and the drag of unit drive speeds in columns of F (r, m)."""
    D[:], F[:] = 0.0, 0.0
    r = V.shape[1]
    p = np.empty(r)
    for c in range(model.cables.shape[0]):
        for h in range(model.first_hole[c], model.first_hole[c + 1] - 1):
            if drag.coefficient[h] > 0.0:
                p[:] = 0.0
                for k in range(V.shape[0]):
                    value = drag.path[h, k]
                    if value != 0.0:
                        for i in range(r):
                            p[i] += value * V[k, i]
                for i in range(r):
                    F[i, c] -= drag.coefficient[h] * drag.through[h] * p[i]
                    for j in range(r):
                        D[i, j] += drag.coefficient[h] * p[i] * p[j]
