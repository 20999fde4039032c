"""Linearised response of end pose and tensions over a horizon: free motion, and unit ramps of every drive.

Near a stable equilibrium q_eq(d) of the model the robot moves by δ = q - q_eq with

    M δ̈ + (α M + D) δ̇ + A δ = -G'C (t u) - F u,        A = K + G'C G,   C = diag(k_c)

with the drag D, F of dithered holes (robot.hole_drag), which follows D δ̇ + F u with a time constant. Element
dampers are left out: beside α they add a part in a thousand of critical damping to the slow modes.
The tangent must be taken at an equilibrium: the slow lateral modes are so soft (a few N/m) that the unbalanced
axial forces of any other configuration, divided by the robot's length, would outweigh their stiffness.

The motion is projected on a small M-orthonormal basis V: the lowest modes, followed from step to step by one
orthogonal iteration V <- A^-1 M V [GVL13, Sec. 8.2.4], and the static answers A^-1 G'C to the drives, which make
the final value of every ramp exact (time steps: robot.reduced_motion). Cables count as two-sided, so that a slack
cable still has authority over its (negative) predicted tension.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.numerics import block_banded
from tcrctl.robot import linear, pose
from tcrctl.robot.equations import Workspace
from tcrctl.robot.hole_drag import HoleDrag, project_drag
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED, SIZE
from tcrctl.robot.reduced_motion import GAMMA, Pull, step
from tcrctl.signals import Array

#: Rows of the end pose in a response: position, normal, twist.
POSE_ROWS = 7
#: A column that keeps less than this part of its length beside the others adds nothing but rounding.
DEPENDENT = 1e-6


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


@njit(cache=True, error_model="numpy")
def mass_columns(mass: Array, X: Array, out: Array) -> None:
    """Set out = M X for columns X (n_free, r)."""
    for k in range(X.shape[0]):
        i, a = k // SIZE, k % SIZE
        for c in range(X.shape[1]):
            out[k, c] = 0.0
        for b in range(SIZE):
            value = mass[i, a, b]
            if value != 0.0:
                for c in range(X.shape[1]):
                    out[k, c] += value * X[SIZE * i + b, c]


@njit(cache=True, error_model="numpy")
def _orthonormalise(mass: Array, V: Array, MV: Array) -> None:
    """Orthonormalise the columns of V (n_free, r) in the mass inner product (Gram-Schmidt); fills MV = M V.

    Dependent columns become zero. Rows of the transposed copies are vectors, so that inner loops are contiguous.
    """
    size, r = V.shape
    W, MW = np.empty((r, size)), np.empty((r, size))
    mass_columns(mass, V, MV)
    for j in range(r):
        before = 0.0
        for k in range(size):
            W[j, k], MW[j, k] = V[k, j], MV[k, j]
            before += V[k, j] * MV[k, j]
        after = before
        for _ in range(2):
            for i in range(j):
                overlap = np.dot(MW[i], W[j])
                for k in range(size):
                    W[j, k] -= overlap * W[i, k]
                    MW[j, k] -= overlap * MW[i, k]
            after = np.dot(W[j], MW[j])
        scale = 1.0 / np.sqrt(after) if after > DEPENDENT * DEPENDENT * before else 0.0
        for k in range(size):
            W[j, k] *= scale
            MW[j, k] *= scale
            V[k, j], MV[k, j] = W[j, k], MW[j, k]


@njit(cache=True, error_model="numpy")
def refine_basis(model: Model, ws: Workspace, V: Array) -> None:
    """Iterate the modes in V once; its last m columns become the static answers to the drives.

    Args:
        model: Robot arrays.
        ws: K, U, G at a stable equilibrium, with :func:`tcrctl.robot.linear.couple` done.
        V: Basis (n_free, modes + m), changed.
    """
    m, size = ws.axial.shape[0], V.shape[0]
    MV = np.empty(V.shape)
    mass_columns(model.mass, V, MV)
    for k in range(size):
        for c in range(m):
            MV[k, V.shape[1] - m + c] = ws.axial[c] * ws.G[c, 3 * FIXED + k]
    linear.solve_many(ws, MV)
    V[:] = MV
    _orthonormalise(model.mass, V, MV)


@njit(cache=True, error_model="numpy")
def _project(ws: Workspace, V: Array, GV: Array) -> Array:
    """Return the reduced stiffness V'AV (r, r); fills GV = G V (m, r)."""
    size, r = V.shape
    KV = np.empty((size, r))
    block_banded.multiply_columns(ws.K, V, KV)
    reduced = np.zeros((r, r))
    for k in range(size):
        for i in range(r):
            v = V[k, i]
            for j in range(r):
                reduced[i, j] += v * KV[k, j]
    for cable in range(GV.shape[0]):
        for i in range(r):
            GV[cable, i] = 0.0
        for k in range(size):
            g = ws.G[cable, 3 * FIXED + k]
            if g != 0.0:
                for i in range(r):
                    GV[cable, i] += g * V[k, i]
        for i in range(r):
            for j in range(r):
                reduced[i, j] += ws.axial[cable] * GV[cable, i] * GV[cable, j]
    return reduced


@njit(cache=True, error_model="numpy")
def _pull(model: Model, ws: Workspace, V: Array, GV: Array, drag: Drag, h: float) -> Pull:
    """Return what acts in steps of h on the basis V, GV = G V (m, r)."""
    m, r = GV.shape
    pull = Pull(
        np.zeros((r, m + 1)),
        np.zeros((r, m + 1)),
        np.zeros((r, r)),
        GAMMA * h / (drag.time + GAMMA * h),
        np.zeros((r, m + 1)),
    )
    project_drag(model, drag.holes, V, pull.drag, pull.steady)
    pull.drag[:] *= pull.turned
    pull.steady[:] *= pull.turned
    for i in range(r):
        for k in range(V.shape[0]):
            pull.held[i, m] += V[k, i] * drag.held[k]
        for c in range(m):
            pull.growing[i, c] = -ws.axial[c] * GV[c, i]
    return pull


@njit(cache=True, error_model="numpy")
def _observe(CV: Array, GV: Array, axial: Array, t: float, x: Array, out: Array) -> None:
    """Fill out (7 + m, m + 1), end pose and tension changes of reduced positions x (r, m + 1)."""
    m = axial.shape[0]
    out[:POSE_ROWS] = np.dot(CV, x)
    out[POSE_ROWS:] = np.dot(GV, x)
    for cable in range(m):
        out[POSE_ROWS + cable, cable] += t
        for c in range(m + 1):
            out[POSE_ROWS + cable, c] *= axial[cable]


@njit(cache=True, error_model="numpy")
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
        q_eq: Stable equilibrium (3 n_nodes,) [m]; ``ws`` holds K, its factor U and G there.
        release: The state.
        ahead: Times of the responses after it, equally spaced from 0 (steps,) [s].
        tip: Row of the first node of the tip ring.
        ws: Workspace of the static solve that found ``q_eq``.
        V: Basis (n_free, modes + m), refined by this call; see :func:`start_basis`.
        drag: Of the holes at ``q_eq``.

    Returns:
        change (steps, 7 + m, m + 1) of position [m], normal, twist [rad] and tensions [N] since the state:
        column c for a unit ramp of drive c (1 m/s), column m for the free motion; and whether the reduced
        tangent was positive definite.
    """
    m = model.cables.shape[0]
    r = V.shape[1]
    first = 3 * (tip - FIXED)
    h, steps = ahead[0], ahead.shape[0]
    for c in range(m):
        ws.axial[c] = model.cables[c, STIFFNESS]
    linear.couple(ws, ws.r)
    refine_basis(model, ws, V)
    GV, b = np.empty((m, r)), 1.0 / (GAMMA * h)
    reduced = _project(ws, V, GV)
    a = b * b + model.damping * b
    pull = _pull(model, ws, V, GV, drag, h)
    unseen = _pull_further(model.mass, V, reduced, release.gain, GV, pull)
    for i in range(r):
        reduced[i, i] += a
        for j in range(r):
            reduced[i, j] += b * pull.drag[i, j]
    CV = np.dot(pose.output_matrix(q_eq, tip), V[first : first + 9])
    x, vx = np.zeros((r, m + 1)), np.zeros((r, m + 1))
    start = np.zeros((POSE_ROWS + m, m + 1))
    change = np.zeros((steps, POSE_ROWS + m, m + 1))
    if not block_banded.factor_diagonal(reduced):
        return change, False
    _project_state(model.mass, V, release.offset, release.v, x, vx)
    _observe(CV, GV, ws.axial, 0.0, x, start)
    for n in range(steps):
        step(reduced, model.damping, n * h, h, pull, x, vx)
        _observe(CV, GV, ws.axial, n * h + h, x, change[n])
        change[n] -= start
        for cable in range(m):
            for c in range(m):
                change[n, POSE_ROWS + cable, c] -= ws.axial[cable] * unseen[cable, c] * (n * h + h)
    return change, True


@njit(cache=True, error_model="numpy")
def _pull_further(mass: Array, V: Array, stiffness: Array, gain: Array, GV: Array, pull: Pull) -> Array:
    """Let unit ramps end where they do with ``gain`` (n_free, m) more; return the cable lengths of it (m, m).

    The forces that do it are those of the basis' stiffness (r, r). Cables do not feel them: what they would be
    longer by is no tension, because the cables of the robot are as long as their drives say.
    """
    weighted = np.empty(gain.shape)
    mass_columns(mass, gain, weighted)
    further = np.dot(V.T, weighted)
    pull.growing[:, : gain.shape[1]] += np.dot(stiffness, further)
    lengths: Array = np.dot(GV, further)
    return lengths


@njit(cache=True, error_model="numpy")
def _project_state(mass: Array, V: Array, offset: Array, v: Array, x: Array, vx: Array) -> None:
    """Set last columns of x, vx (r, m + 1) to V'M offset, V'M v: the part of the state that the basis shows."""
    size, last = V.shape[0], x.shape[1] - 1
    state, weighted = np.empty((size, 2)), np.empty((size, 2))
    for k in range(size):
        state[k, 0], state[k, 1] = offset[3 * FIXED + k], v[3 * FIXED + k]
    mass_columns(mass, state, weighted)
    for k in range(size):
        for i in range(V.shape[1]):
            x[i, last] += V[k, i] * weighted[k, 0]
            vx[i, last] += V[k, i] * weighted[k, 1]


def start_basis(model: Model, ws: Workspace, modes: int, iterations: int = 30) -> Array:
    """Return the basis (n_free, modes + m) at the stable equilibrium that ``ws`` (K, U, G) belongs to.

    Starts from a fixed pseudo-random block; 30 orthogonal iterations separate modes a factor 2 apart in
    frequency to 1e-18.
    """
    size, m = ws.r.shape[0], model.cables.shape[0]
    V = np.random.default_rng(0).standard_normal((size, min(modes, size - m) + m))
    ws.axial[:] = model.cables[:, STIFFNESS]
    linear.couple(ws, ws.r)
    for _ in range(iterations):
        refine_basis(model, ws, V)
    return V
