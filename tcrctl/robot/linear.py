"""Solves with the robot's tangent: block-banded K plus one rank-1 term per taut cable.

A = K + G' C G with C = diag(k_c). With Y = K^-1 G', R = C^(1/2), P = I + R G Y R (Woodbury, [GVL13] Sec. 2.1.4)

    A^-1 b = x - Y R P^-1 R G x,   x = K^-1 b,           A^-1 G' C = Y R P^-1 R

which also covers slack cables (k_c = 0). It equals the bordered system (26) with λ kept as unknown.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tcrctl.numerics import block_banded
from tcrctl.robot.equations import Workspace
from tcrctl.robot.model import FIXED
from tcrctl.signals import Array

#: First diagonal shift tried on an indefinite tangent, as a fraction of its mean diagonal.
FIRST_SHIFT = 1e-9
SHIFT_GROWTH = 30.0


@njit(cache=True, error_model="numpy")
def factor_shifted(K: Array, U: Array) -> float:
    """Factor K into U, adding the smallest tried multiple of the identity that makes it positive definite.

    Args:
        K: Block-banded symmetric matrix (n, w + 1, 12, 12) [N/m]; unchanged.
        U: Output factor, same shape.

    Returns:
        The shift [N/m]: 0 for a positive definite K; -1 if no shift helped (NaN in K). [NW06] Sec. 3.4.
    """
    U[:] = K
    if block_banded.factor(U):
        return 0.0
    n, b = K.shape[0], K.shape[2]
    mean = 0.0
    for j in range(n):
        for a in range(b):
            mean += abs(K[j, 0, a, a]) / (n * b)
    shift = FIRST_SHIFT * mean
    while shift < 1e3 * mean:
        U[:] = K
        for j in range(n):
            for a in range(b):
                U[j, 0, a, a] += shift
        if block_banded.factor(U):
            return shift
        shift *= SHIFT_GROWTH
    return -1.0


@njit(cache=True, error_model="numpy")
def couple(ws: Workspace, b: Array) -> None:
    """columns = K^-1 [G' R, b];  small = Cholesky factor of P = I + R G Y R."""
    m, size = ws.axial.shape[0], b.shape[0]
    X = ws.columns
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for i in range(size):
            X[i, c] = root * ws.G[c, 3 * FIXED + i]
    for i in range(size):
        X[i, m] = b[i]
    block_banded.solve(ws.U, X)
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for k in range(m):
            ws.small[c, k] = 1.0 if c == k else 0.0
        for i in range(size):
            g = root * ws.G[c, 3 * FIXED + i]
            if g != 0.0:
                for k in range(m):
                    ws.small[c, k] += g * X[i, k]
    block_banded.factor_diagonal(ws.small)


@njit(cache=True, error_model="numpy")
def solve(ws: Workspace, b: Array, x: Array) -> None:
    """Solve A x = b with the factor in ``ws.U`` and the cables in ``ws``.

    Args:
        ws: U, G and axial stiffness at one configuration.
        b: Right-hand side (12 n_modules,).
        x: Output (12 n_modules,).
    """
    couple(ws, b)
    m = ws.axial.shape[0]
    weight = np.zeros((m, 1))
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for i in range(b.shape[0]):
            weight[c, 0] += root * ws.G[c, 3 * FIXED + i] * ws.columns[i, m]
    block_banded.solve_transposed(ws.small, weight)
    block_banded.solve_upper(ws.small, weight)
    for i in range(b.shape[0]):
        x[i] = ws.columns[i, m]
        for c in range(m):
            x[i] -= ws.columns[i, c] * weight[c, 0]


@njit(cache=True, error_model="numpy")
def solve_many(ws: Workspace, X: Array) -> None:
    """Overwrite columns X (12 n_modules, r) by A^-1 X; ``columns`` and ``small`` as :func:`couple` left them."""
    m, size, r = ws.axial.shape[0], X.shape[0], X.shape[1]
    block_banded.solve(ws.U, X)
    weight = np.zeros((m, r))
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for k in range(size):
            g = root * ws.G[c, 3 * FIXED + k]
            if g != 0.0:
                for j in range(r):
                    weight[c, j] += g * X[k, j]
    block_banded.solve_transposed(ws.small, weight)
    block_banded.solve_upper(ws.small, weight)
    for k in range(size):
        for c in range(m):
            y = ws.columns[k, c]
            for j in range(r):
                X[k, j] -= y * weight[c, j]


@njit(cache=True, error_model="numpy")
def drive_gain(ws: Workspace, gain: Array) -> None:
    """∂q/∂d = -A^-1 G' C at the configuration in ``ws``.

    Args:
        ws: U, G and axial stiffness; ``columns`` and ``small`` as the last :func:`solve` left them.
        gain: Output (12 n_modules, m); the sensitivity of the free coordinates to the drives.
    """
    m = ws.axial.shape[0]
    weight = np.zeros((m, m))
    for c in range(m):
        weight[c, c] = -np.sqrt(ws.axial[c])
    block_banded.solve_transposed(ws.small, weight)
    block_banded.solve_upper(ws.small, weight)
    for i in range(gain.shape[0]):
        for c in range(m):
            total = 0.0
            for k in range(m):
                total += ws.columns[i, k] * weight[k, c]
            gain[i, c] = total


@njit(cache=True, error_model="numpy")
def tension_gain(ws: Workspace, gain: Array) -> Array:
    """∂λ/∂d = C (I + G ∂q/∂d) (m, m) [N/m] for the ``gain`` of :func:`drive_gain`."""
    m = ws.axial.shape[0]
    out = np.zeros((m, m))
    for c in range(m):
        for k in range(m):
            total = 1.0 if c == k else 0.0
            for i in range(gain.shape[0]):
                total += ws.G[c, 3 * FIXED + i] * gain[i, k]
            out[c, k] = ws.axial[c] * total
    return out
