"""Instantaneous optimal control: the quadratic program (30)-(32) and its solution as an LCP (33)-(40).

The prediction is affine in the inputs U (all blocks of all drives): Y = Y_0 + S U, in the place of (31). Then

    J/2 = 1/2 Σ_n |Y_n - Y_d,n|²_(Q/n) + 1/2 Σ_b (|u_b|²_R + |u_b - u_{b-1}|²_W) = 1/2 U'H U + g'U + const

with rows A U >= b: hard ones for the speed and stroke limits, soft ones (quadratic slack with compliance D) for
the tension floor and ceiling. The KKT conditions are the LCP

    w = (A H^-1 A' + D) κ - A H^-1 g - b,    w >= 0, κ >= 0, w'κ = 0,      U = H^-1 (A'κ - g)

which for one block and box rows only is (39)-(40) with M = -T, q = -φ (REFERENCES.md, correction 4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics import block_banded, block_solves
from tcrctl.numerics.kernel import kernel, part
from tcrctl.numerics.lcp import SOLVED, lcp_residuals, solve_lcp
from tcrctl.robot.response import POSE_ROWS
from tcrctl.signals import Array

#: Rounds in which violated tension rows are added to the LCP.
MAX_ROUNDS = 6
#: A tension row counts as violated beyond this [N].
TENSION_SLACK = 1e-3


class Weights(NamedTuple):
    """Weights of the cost (30) and limits of the tension rows.

    Attributes:
        output: Q for position (3) [1/m2], normal (3), twist (1) [1/rad2], tensions (m) [1/N2] (7 + m,).
        speed: R [s2/m2].
        speed_change: W [s2/m2].
        floor: Lowest tension wanted [N]; -inf for none.
        ceiling: Highest tension wanted [N]; inf for none.
        softness: Compliance of the tension rows [N2].
    """

    output: Array
    speed: float
    speed_change: float
    floor: float
    ceiling: float
    softness: float


class Prediction(NamedTuple):
    """Affine prediction Y = free + gain U.

    Attributes:
        free: Outputs at the prediction instants for U = 0 (n, 7 + m).
        gain: Their derivatives (n, 7 + m, blocks * m).
    """

    free: Array
    gain: Array


class QuadraticProgram(NamedTuple):
    """The quadratic program: 1/2 U'H U + g'U, low <= U <= high, soft tension rows.

    Attributes:
        H: Hessian (U, U).
        g: Gradient at U = 0 (U,).
        low: Lower limits of the inputs (U,) [m/s].
        high: Upper limits (U,) [m/s].
    """

    H: Array
    g: Array
    low: Array
    high: Array


class Solution(NamedTuple):
    """Inputs with proof.

    Attributes:
        inputs: U (blocks * m,) [m/s].
        residual: Largest violation of the LCP's conditions.
        pivots: Pivots of Lemke's algorithm, all rounds.
        solved: The LCP was solved and no tension row outside it is violated.
        rows: Rows of the last LCP; 0 if there was none.
        outputs: Y at the prediction instants with these inputs (n, 7 + m); without any if it is not solved.
    """

    inputs: Array
    residual: float
    pivots: int
    solved: bool
    rows: int
    outputs: Array


@kernel(error_model="numpy")
def build_ioc(
    prediction: Prediction, target: Array, changes: Array, low: Array, high: Array, weights: Weights
) -> QuadraticProgram:
    """Assemble (32) for an affine prediction.

    Args:
        prediction: Predicted outputs.
        target: Outputs wanted (n, 7 + m).
        changes: Changes of speed from block to block that cost nothing, the first one from standstill
            (blocks * m,) [m/s]: the input u_k of the last step, then zeros, is (30).
        low: Lower limits of the inputs (blocks * m,) [m/s].
        high: Upper limits (blocks * m,) [m/s].
        weights: Weights of the cost.
    """
    free, gain = prediction.free, prediction.gain
    n, rows, size = gain.shape
    m = rows - POSE_ROWS
    flat, weighted, error = gain.reshape((n * rows, size)), np.empty((n * rows, size)), np.empty(n * rows)
    for i in range(n):
        for r in range(rows):
            k, q = i * rows + r, weights.output[r]
            error[k] = q * (free[i, r] - target[i, r])
            for a in range(size):
                weighted[k, a] = q * flat[k, a]
    H, g = np.dot(flat.T, weighted), np.dot(flat.T, error)
    for a in range(size):
        H[a, a] += weights.speed + weights.speed_change
        g[a] -= weights.speed_change * changes[a]
        if a >= m:
            g[a - m] += weights.speed_change * changes[a]
            H[a - m, a - m] += weights.speed_change
            H[a - m, a] -= weights.speed_change
    for a in range(size):
        for b in range(a):
            H[a, b] = H[b, a]
    return QuadraticProgram(H, g, low, high)


@part(error_model="numpy")
def _outputs(prediction: Prediction, U: Array) -> Array:
    """Return Y (n, 7 + m)."""
    n, rows, size = prediction.gain.shape
    moved = np.dot(prediction.gain.reshape((n * rows, size)), U)
    Y: Array = prediction.free + moved.reshape((n, rows))
    return Y


@part(error_model="numpy")
def _violated(outputs: Array, weights: Weights, chosen: Array) -> int:
    """Mark newly violated tension rows in ``chosen`` (n, 2 m), floors then ceilings; returns how many are new."""
    new, m = 0, chosen.shape[1] // 2
    for i in range(outputs.shape[0]):
        for c in range(m):
            tension = outputs[i, POSE_ROWS + c]
            if tension < weights.floor - TENSION_SLACK and not chosen[i, c]:
                chosen[i, c] = True
                new += 1
            if tension > weights.ceiling + TENSION_SLACK and not chosen[i, m + c]:
                chosen[i, m + c] = True
                new += 1
    return new


@part(error_model="numpy")
def _rows(
    program: QuadraticProgram, prediction: Prediction, weights: Weights, chosen: Array
) -> tuple[Array, Array, Array]:
    """Return A (rows, U), b (rows,), D (rows,): box rows first, then the chosen tension rows."""
    size, m = program.g.shape[0], chosen.shape[1] // 2
    total = 2 * size + np.sum(chosen)
    A, b, D = np.zeros((total, size)), np.zeros(total), np.zeros(total)
    for a in range(size):
        A[a, a], b[a] = -1.0, -program.high[a]
        A[size + a, a], b[size + a] = 1.0, program.low[a]
    k = 2 * size
    for i in range(chosen.shape[0]):
        for c in range(2 * m):
            if chosen[i, c]:
                side, limit = (1.0, weights.floor) if c < m else (-1.0, weights.ceiling)
                row = POSE_ROWS + c % m
                for a in range(size):
                    A[k, a] = side * prediction.gain[i, row, a]
                b[k] = side * (limit - prediction.free[i, row])
                D[k] = weights.softness
                k += 1
    return A, b, D


@part(error_model="numpy")
def _factor(H: Array) -> Array:
    """Return the Cholesky factor of a positive definite matrix (U, U); NaN if it is not."""
    factor = H.copy()
    if not block_banded.factor_diagonal(factor):
        factor[:] = np.nan
    return factor


@part(error_model="numpy")
def _inverse(factor: Array) -> Array:
    """Return H^-1 (U, U) for the factor of H."""
    inverse = np.eye(factor.shape[0])
    block_banded.solve_transposed(factor, inverse)
    block_banded.solve_upper(factor, inverse)
    return inverse


@part(error_model="numpy")
def _free_minimum(factor: Array, g: Array) -> Array:
    """Return the inputs without any limits -H^-1 g (U,) for the factor of H."""
    U = -g
    block_solves.transposed_vector(factor, U)
    block_solves.upper_vector(factor, U)
    return U


@part(error_model="numpy")
def _inside(program: QuadraticProgram, U: Array) -> bool:
    """Return whether all inputs are within their limits."""
    inside = True
    for a in range(U.shape[0]):
        inside = inside and program.low[a] <= U[a] <= program.high[a]
    return inside


@kernel(error_model="numpy")
def solve_ioc(program: QuadraticProgram, prediction: Prediction, weights: Weights) -> Solution:
    """Solve the program by Lemke's algorithm, adding tension rows until none outside the LCP is violated.

    Args:
        program: From :func:`build_ioc`.
        prediction: The prediction it was built of.
        weights: Limits of the tension rows.
    """
    m, size = prediction.free.shape[1] - POSE_ROWS, program.g.shape[0]
    chosen = np.zeros((prediction.free.shape[0], 2 * m), dtype=np.bool_)
    pivots, rows, residual = 0, 2 * size, np.inf
    factor = _factor(program.H)
    free = _free_minimum(factor, program.g)
    if _inside(program, free):  # κ = 0 solves the LCP, and no input stands at a limit
        Y = _outputs(prediction, free)
        if _violated(Y, weights, chosen) == 0:
            return Solution(free, 0.0, 0, True, rows, Y)
    inverse, U = _inverse(factor), np.zeros(size)
    for _ in range(MAX_ROUNDS):
        A, b, D = _rows(program, prediction, weights, chosen)
        rows = b.shape[0]
        q = -np.dot(A, np.dot(inverse, program.g)) - b
        kappa, residual = np.zeros(rows), 0.0
        if not np.min(q) >= 0.0:  # otherwise κ = 0 solves it
            M = np.dot(np.dot(A, inverse), A.T)
            for k in range(rows):
                M[k, k] += D[k]
            kappa, _, used, status = solve_lcp(M, q)
            pivots += used
            w_low, z_low, product = lcp_residuals(M, q, kappa)
            residual = max(w_low, z_low, product)
            if status != SOLVED:
                break
        U = np.dot(inverse, np.dot(kappa, A) - program.g)
        Y = _outputs(prediction, U)
        if _violated(Y, weights, chosen) == 0:
            return Solution(U, residual, pivots, True, rows, Y)
    return Solution(U, residual, pivots, False, rows, prediction.free)
