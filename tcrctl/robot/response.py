"""Linearised response of end pose and tensions over a horizon: free motion, and unit ramps of every drive.

Near a stable equilibrium q_eq(d) of the model the robot moves by δ = q - q_eq with

    M δ̈ + α M δ̇ + (K + G'C G) δ = -G'C (t u),        C = diag(k_c)

(element dampers are left out: beside α they add a part in a thousand of critical damping to the slow modes).
The tangent must be taken at an equilibrium: the slow lateral modes are so soft (a few N/m) that the unbalanced
axial forces of any other configuration, divided by the robot's length, would outweigh their stiffness.

The rule is the two-stage, L-stable, second-order SDIRK with γ = 1 - 1/√2 [A77]: it damps the stiff rods and keeps
the slow modes; all stages and columns share one factorisation. Cables count as two-sided here, so that a slack
cable still has authority over its (negative) predicted tension.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.numerics import block_banded
from tcrctl.robot import linear, pose
from tcrctl.robot.equations import Workspace
from tcrctl.robot.model import FIXED, Model
from tcrctl.signals import Array

GAMMA = 1.0 - np.sqrt(0.5)
#: Rows of the end pose in a response: position, normal, twist.
POSE_ROWS = 7


@njit(cache=True, error_model="numpy")
def _mass_columns(mass: Array, X: Array, out: Array) -> None:
    """out = M X for columns X (12 n_modules, r)."""
    for k in range(X.shape[0]):
        i, a = k // 12, k % 12
        for c in range(X.shape[1]):
            out[k, c] = 0.0
        for b in range(12):
            value = mass[i, a, b]
            if value != 0.0:
                for c in range(X.shape[1]):
                    out[k, c] += value * X[12 * i + b, c]


@njit(cache=True, error_model="numpy")
def _stage(
    mass: Array, ws: Workspace, a: float, b: float, t: float, q: Array, v: Array, work: Array, X: Array
) -> None:
    """X = (a M + K + G'CG)^-1 (M (a q + b v) + f(t)): positions of one stage from its explicit parts q, v."""
    m = ws.axial.shape[0]
    for k in range(q.shape[0]):
        for c in range(m + 1):
            work[k, c] = a * q[k, c] + b * v[k, c]
    _mass_columns(mass, work, X)
    for k in range(q.shape[0]):
        for c in range(m):
            X[k, c] -= t * ws.axial[c] * ws.G[c, 3 * FIXED + k]
    block_banded.solve(ws.U, X)
    weight = np.zeros((m, m + 1))
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for k in range(q.shape[0]):
            g = root * ws.G[c, 3 * FIXED + k]
            if g != 0.0:
                for j in range(m + 1):
                    weight[c, j] += g * X[k, j]
    block_banded.solve_transposed(ws.small, weight)
    block_banded.solve_upper(ws.small, weight)
    for k in range(q.shape[0]):
        for c in range(m):
            for j in range(m + 1):
                X[k, j] -= ws.columns[k, c] * weight[c, j]


@njit(cache=True, error_model="numpy")
def _observe(C: Array, first: int, t: float, ws: Workspace, X: Array, out: Array) -> None:
    """out (7 + m, m + 1) = end pose and tension changes that belong to displacements X (12 n_modules, m + 1)."""
    m = ws.axial.shape[0]
    out[:] = 0.0
    for row in range(POSE_ROWS):
        for k in range(9):
            for c in range(m + 1):
                out[row, c] += C[row, k] * X[first + k, c]
    for cable in range(m):
        row = POSE_ROWS + cable
        for k in range(X.shape[0]):
            g = ws.G[cable, 3 * FIXED + k]
            if g != 0.0:
                for c in range(m + 1):
                    out[row, c] += g * X[k, c]
        out[row, cable] += t
        for c in range(m + 1):
            out[row, c] *= ws.axial[cable]


@njit(cache=True, error_model="numpy")
def respond(
    model: Model, q_eq: Array, offset: Array, v: Array, step: float, steps: int, tip: int, ws: Workspace
) -> tuple[Array, float]:
    """Changes of end pose and tensions at the times step, 2 step, ... after a state.

    Args:
        model: Robot arrays.
        q_eq: Stable equilibrium (3 n_nodes,) [m]; ``ws`` holds K and G there.
        offset: Displacement of the state from the point it will come to rest at (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        step: Time between responses [s].
        steps: Number of responses.
        tip: Row of the first node of the tip ring.
        ws: Workspace of the static solve that found ``q_eq``; K is changed.

    Returns:
        change (steps, 7 + m, m + 1) of position [m], normal, twist [rad] and tensions [N] since the state:
        column c for a unit ramp of drive c (1 m/s), column m for the free motion; and the diagonal shift that
        the tangent needed [N/m], -1 if it failed.
    """
    m, size = model.cables.shape[0], ws.r.shape[0]
    for c in range(m):
        ws.axial[c] = model.cables[c, STIFFNESS]
    b = 1.0 / (GAMMA * step)
    a = b * b + model.damping * b
    for i in range(model.mass.shape[0]):
        for k in range(12):
            for j in range(12):
                ws.K[i, 0, k, j] += a * model.mass[i, k, j]
    change = np.zeros((steps, POSE_ROWS + m, m + 1))
    shift = linear.factor_shifted(ws.K, ws.U)
    if shift < 0.0:
        return change, shift
    linear.couple(ws, ws.r)
    C = pose.output_matrix(q_eq, tip)
    x, vx, work = np.zeros((size, m + 1)), np.zeros((size, m + 1)), np.empty((size, m + 1))
    first, second = np.empty((size, m + 1)), np.empty((size, m + 1))
    start = np.zeros((POSE_ROWS + m, m + 1))
    for k in range(size):
        x[k, m], vx[k, m] = offset[3 * FIXED + k], v[3 * FIXED + k]
    _observe(C, 3 * (tip - FIXED), 0.0, ws, x, start)
    for n in range(steps):
        t = n * step
        _stage(model.mass, ws, a, b, t + GAMMA * step, x, vx, work, first)
        for k in range(size):
            for c in range(m + 1):
                v1 = b * (first[k, c] - x[k, c])
                x[k, c] += (1.0 - GAMMA) * step * v1
                vx[k, c] += (1.0 - GAMMA) * step * b * (v1 - vx[k, c])
        _stage(model.mass, ws, a, b, t + step, x, vx, work, second)
        for k in range(size):
            for c in range(m + 1):
                vx[k, c] = b * (second[k, c] - x[k, c])
                x[k, c] = second[k, c]
        _observe(C, 3 * (tip - FIXED), t + step, ws, x, change[n])
        change[n] -= start
    return change, shift
