"""Drag of dithered holes: what is left of the friction of cables that are moved to and fro all the time.

Material slips through hole i at the rate (1 - ξ_i) u + p_i' v, with the drive speed u, the path x_i from the
actuator to the hole, ξ_i = x_i / l, and p_i = ∂x_i/∂q - ξ_i ∂l/∂q: what a stretched cable gives way on both sides
of the hole is left out. Friction F_i = T (exp(μ θ_i) - 1) [SC26] whose sign turns with a dither of amplitude A, and
needs the time τ for every turn, holds against the mean slip with c_i = F_i τ / A times its rate, so that

    M v' + ... = - Σ_i c_i p_i ((1 - ξ_i) u + p_i' v)

which takes energy out of any motion. See docs/control.md.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.elements.rubbing_cable import largest_friction
from tcrctl.elements.sliding_cable import LEAD, segment, spread
from tcrctl.numerics.kernel import part
from tcrctl.robot.equations import Workspace
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED, SIZE
from tcrctl.signals import Array

#: Smallest amplitude that keeps a cable sliding [m].
SMALL: Final = 0.4e-3


class HoleDrag(NamedTuple):
    """Drag of all holes, changed in place; rows of anchors are zero.

    Attributes:
        coefficient: c_h (n_holes,) [N s/m].
        path: p_h (n_holes, n_free).
        through: 1 - ξ_h (n_holes,).
    """

    coefficient: Array
    path: Array
    through: Array


def no_drag(model: Model) -> HoleDrag:
    """Return drag of none of a robot's holes."""
    n = model.hole_nodes.shape[0]
    return HoleDrag(np.zeros(n), np.zeros((n, SIZE * model.mass.shape[0])), np.zeros(n))


def turn(time: float, amplitude: float) -> float:
    """Return τ / A [s/m] of a dither; one below :data:`SMALL` keeps no cable sliding, and no drag is counted: 0.

    Args:
        time: τ [s].
        amplitude: A [m].
    """
    return time / amplitude if amplitude >= SMALL else 0.0


@part(error_model="numpy")
def fill_hole_drag(
    model: Model, q: Array, ws: Workspace, friction: Array, turn: float, drag: HoleDrag
) -> None:
    """Fill the drag of all holes.

    Args:
        model: Robot arrays.
        q: Node positions (3 n_nodes,) [m].
        ws: Tensions and path gradients there.
        friction: Of every hole (n_holes, 3), columns as in ``elements.rubbing_cable``.
        turn: τ / A [s/m]; 0 for no drag, and nothing else is filled then.
        drag: Filled.
    """
    drag.coefficient[:] = 0.0
    if turn == 0.0:
        return
    nodes, weights = model.hole_nodes, model.hole_weights
    row = np.zeros((1, q.shape[0]))
    for c in range(model.cables.shape[0]):
        first, last = model.first_hole[c], model.first_hole[c + 1] - 1
        total = model.cables[c, LEAD]
        for hole in range(first, last):
            total += segment(q, nodes, weights, hole)[0]
        row[:] = 0.0
        x, bx, by, bz = model.cables[c, LEAD], 0.0, 0.0, 0.0
        for hole in range(first, last):
            length, ex, ey, ez = segment(q, nodes, weights, hole)
            along = bx * ex + by * ey + bz * ez if hole > first else 1.0
            ratio = x / total
            held = largest_friction(friction[hole], along, max(ws.tension[c], 0.0))
            drag.coefficient[hole], drag.through[hole] = turn * held, 1.0 - ratio
            for k in range(drag.path.shape[1]):
                drag.path[hole, k] = row[0, 3 * FIXED + k] - ratio * ws.G[c, 3 * FIXED + k]
            spread(row, 0, nodes, weights, hole, -ex, -ey, -ez)
            spread(row, 0, nodes, weights, hole + 1, ex, ey, ez)
            x, bx, by, bz = x + length, ex, ey, ez


@part(error_model="numpy")
def drag_force(model: Model, drag: HoleDrag, v: Array, speed: Array, force: Array) -> None:
    """Add the drag at node velocities v (3 n_nodes,) and drive speeds (m,) [m/s] to a force (n_free,) [N]."""
    for c in range(model.cables.shape[0]):
        for hole in range(model.first_hole[c], model.first_hole[c + 1] - 1):
            if drag.coefficient[hole] > 0.0:
                slip = drag.through[hole] * speed[c]
                for k in range(force.shape[0]):
                    slip += drag.path[hole, k] * v[3 * FIXED + k]
                for k in range(force.shape[0]):
                    force[k] -= drag.coefficient[hole] * slip * drag.path[hole, k]


@part(error_model="numpy")
def project_drag(model: Model, drag: HoleDrag, V: Array, D: Array, F: Array) -> None:
    """Add the reduced drag matrix to D (r, r), and the drag of unit drive speeds to columns of F (r, m + 1)."""
    r = V.shape[1]
    p = np.empty(r)
    for c in range(model.cables.shape[0]):
        for hole in range(model.first_hole[c], model.first_hole[c + 1] - 1):
            if drag.coefficient[hole] > 0.0:
                p[:] = 0.0
                for k in range(V.shape[0]):
                    value = drag.path[hole, k]
                    if value != 0.0:
                        for i in range(r):
                            p[i] += value * V[k, i]
                for i in range(r):
                    F[i, c] -= drag.coefficient[hole] * drag.through[hole] * p[i]
                    for j in range(r):
                        D[i, j] += drag.coefficient[hole] * p[i] * p[j]
