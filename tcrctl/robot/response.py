"""Linearised response of end pose and tensions over a horizon: free motion, and unit ramps of every drive.

Near a stable equilibrium q_eq(d) of the model the robot moves by δ = q - q_eq with

    M δ̈ + (α M + D) δ̇ + A δ = -G'C (t u) - F u,        A = K + G'C G,   C = diag(k_c)

with the drag D, F of dithered holes (robot.hole_drag), which follows D δ̇ + F u with a time constant. Element
dampers are left out: beside α they add a part in a thousand of critical damping to the slow modes.
The tangent must be taken at an equilibrium: the slow lateral modes are so soft (a few N/m) that the unbalanced
axial forces of any other configuration, divided by the robot's length, would outweigh their stiffness.

The motion is projected on a small M-orthonormal basis V: the lowest modes, followed from step to step, and the
static answers A^-1 G'C to the drives, which make the final value of every ramp exact (robot.response_basis; time
steps: robot.reduced_motion). Cables count as two-sided, so that a slack cable still has authority over its
(negative) predicted tension.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics.copies import copy_rows, copy_vector, scale_rows
from tcrctl.numerics.kernel import part
from tcrctl.robot import pose
from tcrctl.robot.equations import Workspace
from tcrctl.robot.hole_drag import HoleDrag, project_drag
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.robot.reduced_motion import GAMMA, Pull, prepare, step
from tcrctl.robot.response_basis import Reduced, count_as_taut, refine_basis
from tcrctl.signals import Array

#: Rows of the end pose in a response: position, normal, twist.
POSE_ROWS = 7


class Release(NamedTuple):
    """How the robot is let go.

    Attributes:
        offset: Displacement from the point that it will come to rest at (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        gain: By how much more than the model's that point moves with every drive (n_free, m).
    """

    offset: Array
    v: Array
    gain: Array


class Drag(NamedTuple):
    """Drag that follows the slip.

    Attributes:
        holes: What it goes to.
        held: What it is now (n_free,) [N].
        time: Time constant τ [s]; 0 if it follows at once.
    """

    holes: HoleDrag
    held: Array
    time: float


@part(error_model="numpy")
def _pull(model: Model, ws: Workspace, V: Array, lengths: Array, drag: Drag, h: float) -> Pull:
    """Return what acts in steps of h on the basis V; ``lengths`` are G V (m, r)."""
    m, r = lengths.shape
    drags = False
    for k in range(drag.held.shape[0]):
        drags = drags or drag.held[k] != 0.0
    for hole in range(drag.holes.coefficient.shape[0]):
        drags = drags or drag.holes.coefficient[hole] != 0.0
    turned = GAMMA * h / (drag.time + GAMMA * h)
    forces = np.zeros((3, r, m + 1))
    pull = Pull(forces[0], forces[1], np.zeros((r, r)), turned, forces[2], drags)
    for i in range(r):
        for c in range(m):
            pull.growing[i, c] = -ws.axial[c] * lengths[c, i]
    if drags:
        project_drag(model, drag.holes, V, pull.drag, pull.steady)
        scale_rows(pull.drag, turned)
        scale_rows(pull.steady, turned)
        copy_vector(np.dot(V.T, drag.held), pull.held[:, m])
    return pull


@part(error_model="numpy")
def _pull_further(reduced: Reduced, gain: Array, pull: Pull) -> Array:
    """Let unit ramps end where they do with ``gain`` (n_free, m) more; return the cable lengths of it (m, m).

    The forces that do it are those of the basis' stiffness. Cables do not feel them: what they would be longer by
    is no tension, because the cables of the robot are as long as their drives say.
    """
    further = np.dot(reduced.weighted.T, gain)
    force = np.dot(reduced.stiffness, further)
    for i in range(force.shape[0]):
        for c in range(force.shape[1]):
            pull.growing[i, c] += force[i, c]
    lengths: Array = np.dot(reduced.lengths, further)
    return lengths


@part(error_model="numpy")
def _observe(C: Array, axial: Array, unseen: Array, t: float, x: Array, out: Array) -> None:
    """Fill out (7 + m, m + 1), end pose and tension changes of reduced positions x (r, m + 1).

    Args:
        C: End pose and cable lengths by the reduced positions (7 + m, r).
        axial: Stiffness of the cables (m,) [N/m].
        unseen: Lengths per second that are no tension (m, m) [m].
        t: Time since the state [s].
        x: Reduced positions.
        out: Filled.
    """
    m = axial.shape[0]
    np.dot(C, x, out)
    for cable in range(m):
        out[POSE_ROWS + cable, cable] += t
        for c in range(m):
            out[POSE_ROWS + cable, c] -= t * unseen[cable, c]
        for c in range(m + 1):
            out[POSE_ROWS + cable, c] *= axial[cable]


@part(error_model="numpy")
def respond(
    model: Model,
    q_eq: Array,
    release: Release,
    ahead: Array,
    tip: int,
    ws: Workspace,
    V: Array,
    drag: Drag,
) -> tuple[Array, bool]:
    """Predict changes of end pose and tensions after a state.

    Args:
        model: Robot arrays.
        q_eq: Stable equilibrium (3 n_nodes,) [m].
        release: The state.
        ahead: Times of the responses after it, equally spaced from 0 (steps,) [s].
        tip: Row of the first node of the tip ring.
        ws: Workspace of the static solve that found ``q_eq``: U, G, and coupled (``linear.couple``).
        V: Basis (n_free, modes + m), refined by this call; see ``response_basis``.
        drag: Of the holes at ``q_eq``.

    Returns:
        change (steps, 7 + m, m + 1) of position [m], normal, twist [rad] and tensions [N] since the state:
        column c for a unit ramp of drive c (1 m/s), column m for the free motion; and whether the reduced
        tangent was positive definite.
    """
    m, h = model.cables.shape[0], ahead[0]
    count_as_taut(model, ws)
    reduced = refine_basis(model, ws, V)
    pull = _pull(model, ws, V, reduced.lengths, drag, h)
    unseen = _pull_further(reduced, release.gain, pull)
    change = np.zeros((ahead.shape[0], POSE_ROWS + m, m + 1))
    stepping, stable = prepare(reduced.stiffness, model.damping, h, pull)
    if not stable:
        return change, False
    C = _output_rows(q_eq, tip, V, reduced.lengths)
    x, vx, start = np.zeros((V.shape[1], m + 1)), np.zeros((V.shape[1], m + 1)), np.empty(change.shape[1:])
    copy_vector(
        np.dot(reduced.weighted.T, release.offset[3 * FIXED :]), x[:, m]
    )  # what the basis shows of it
    copy_vector(np.dot(reduced.weighted.T, release.v[3 * FIXED :]), vx[:, m])
    _observe(C, ws.axial, unseen, 0.0, x, start)
    for n in range(change.shape[0]):
        step(stepping, n * h, pull, x, vx)
        _observe(C, ws.axial, unseen, n * h + h, x, change[n])
        for i in range(start.shape[0]):
            for c in range(start.shape[1]):
                change[n, i, c] -= start[i, c]
    return change, True


@part(error_model="numpy")
def _output_rows(q_eq: Array, tip: int, V: Array, lengths: Array) -> Array:
    """Return end pose and cable lengths by the reduced positions (7 + m, r)."""
    first, C = 3 * (tip - FIXED), np.empty((POSE_ROWS + lengths.shape[0], V.shape[1]))
    np.dot(pose.output_matrix(q_eq, tip), V[first : first + 9], C[:POSE_ROWS])
    copy_rows(lengths, C[POSE_ROWS:])
    return C
