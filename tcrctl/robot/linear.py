"""Solves with the robot's tangent: block-banded K plus one rank-1 term per taut cable.

A = K + G' C G with C = diag(k_c), K = U'U. With R = C^(1/2), W = U'^-1 G' R and P = I + W'W (Woodbury,
[GVL13] Sec. 2.1.4)

    A^-1 = U^-1 (I - W P^-1 W') U'^-1

which also covers slack cables (k_c = 0) and needs only half a solve for each cable. It equals the bordered
system (26) with λ kept as unknown.
"""

from __future__ import annotations

import numpy as np

from tcrctl.elements.rubbing_cable import Stretches
from tcrctl.numerics import block_banded, block_solves
from tcrctl.numerics.kernel import kernel, part
from tcrctl.robot.equations import Workspace
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array

#: First diagonal shift tried on an indefinite tangent, as a fraction of its mean diagonal.
FIRST_SHIFT = 1e-9
SHIFT_GROWTH = 30.0


@part(error_model="numpy")
def _copy(K: Array, U: Array) -> None:
    """Set U = K in plain loops, which compile in a tenth of the time of a slice assignment."""
    for j in range(K.shape[0]):
        for d in range(K.shape[1]):
            for a in range(K.shape[2]):
                for b in range(K.shape[3]):
                    U[j, d, a, b] = K[j, d, a, b]


@kernel(error_model="numpy")
def factor_shifted(K: Array, U: Array) -> float:
    """Factor K into U, adding the smallest tried multiple of the identity that makes it positive definite.

    Args:
        K: Block-banded symmetric matrix (n, w + 1, 12, 12) [N/m]; unchanged.
        U: Output factor, same shape.

    Returns:
        The shift [N/m]: 0 for a positive definite K; -1 if no shift helped (NaN in K). [NW06] Sec. 3.4.
    """
    _copy(K, U)
    if block_banded.factor(U):
        return 0.0
    n, b = K.shape[0], K.shape[2]
    mean = 0.0
    for j in range(n):
        for a in range(b):
            mean += abs(K[j, 0, a, a]) / (n * b)
    shift = FIRST_SHIFT * mean
    while shift < 1e3 * mean:
        _copy(K, U)
        for j in range(n):
            for a in range(b):
                U[j, 0, a, a] += shift
        if block_banded.factor(U):
            return shift
        shift *= SHIFT_GROWTH
    return -1.0


@part(error_model="numpy")
def in_use(ws: Workspace, stretches: Stretches | None) -> Workspace:
    """Return ``ws`` with as many rank-1 rows as are in use: cables, or groups of stretches of cables that rub."""
    if stretches is None:
        return ws
    r, size = stretches.groups[0], ws.r.shape[0]
    wide = block_banded.padded(r + 1)
    columns = stretches.columns[: size * wide].reshape((size, wide))
    small = stretches.small[: r * r].reshape((r, r))
    return Workspace(
        ws.K, ws.U, ws.r, ws.G[:r], ws.tension, ws.axial[:r], ws.length, columns, small, stretches
    )


@kernel(error_model="numpy")
def couple(ws: Workspace, b: Array) -> None:
    """Fill columns = U'^-1 [G'R, b, 0] = [W, U'^-1 b, 0] and small = Cholesky factor of P = I + W'W."""
    m, size = ws.axial.shape[0], b.shape[0]
    X = ws.columns
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for i in range(size):
            X[i, c] = root * ws.G[c, 3 * FIXED + i]
    for i in range(size):
        X[i, m] = b[i]
        for c in range(m + 1, X.shape[1]):
            X[i, c] = 0.0
    block_banded.solve_forward(ws.U, X)
    for c in range(m):
        for k in range(m):
            ws.small[c, k] = 1.0 if c == k else 0.0
    for i in range(size):
        for c in range(m):
            for k in range(m):
                ws.small[c, k] += X[i, c] * X[i, k]
    block_banded.factor_diagonal(ws.small)


@part(error_model="numpy")
def _finish(ws: Workspace, x: Array) -> None:
    """Overwrite x (n_free,) by U^-1 (I - W P^-1 W') x."""
    m, columns = ws.axial.shape[0], ws.columns
    weight = np.zeros(columns.shape[1])
    for k in range(x.shape[0]):
        for c in range(weight.shape[0]):
            weight[c] += columns[k, c] * x[k]
    block_solves.transposed_vector(ws.small, weight[:m])
    block_solves.upper_vector(ws.small, weight[:m])
    for k in range(x.shape[0]):
        for c in range(m):
            x[k] -= columns[k, c] * weight[c]
    block_solves.backward_vector(ws.U, x)


@kernel(error_model="numpy")
def solve(ws: Workspace, b: Array, x: Array) -> None:
    """Solve A x = b with the factor in ``ws.U`` and the cables in ``ws``.

    Args:
        ws: U, G and axial stiffness at one configuration.
        b: Right-hand side (n_free,).
        x: Output (n_free,).
    """
    couple(ws, b)
    for i in range(b.shape[0]):
        x[i] = ws.columns[i, ws.axial.shape[0]]
    _finish(ws, x)


@part(error_model="numpy")
def solve_again(ws: Workspace, x: Array) -> None:
    """Overwrite x (n_free,) by A^-1 x; ``columns`` and ``small`` as :func:`couple` left them."""
    block_solves.forward_vector(ws.U, x)
    _finish(ws, x)


@part(error_model="numpy")
def _finish_columns(ws: Workspace, X: Array) -> None:
    """Do as :func:`_finish` for many columns."""
    m = ws.axial.shape[0]
    weight = np.dot(ws.columns.T, X)
    block_banded.solve_transposed(ws.small, weight[:m])
    block_banded.solve_upper(ws.small, weight[:m])
    weight[m:] = 0.0  # of the right-hand side that lies beside the cables' columns
    back = np.dot(ws.columns, weight)
    for k in range(X.shape[0]):
        for c in range(X.shape[1]):
            X[k, c] -= back[k, c]
    block_solves.backward_columns(ws.U, X)


@kernel(error_model="numpy")
def solve_many(ws: Workspace, X: Array) -> None:
    """Overwrite columns X (n_free, r) by A^-1 X; ``columns`` and ``small`` as :func:`couple` left them."""
    block_solves.forward_columns(ws.U, X)
    _finish_columns(ws, X)


@kernel(error_model="numpy")
def drive_gain(ws: Workspace, gain: Array) -> None:
    """Fill ∂q/∂d = -A^-1 G' C at the configuration in ``ws``.

    Args:
        ws: U, G and axial stiffness; ``columns`` and ``small`` as :func:`couple` left them.
        gain: Output (n_free, m); the sensitivity of the free coordinates to the drives.
    """
    m = ws.axial.shape[0]
    for c in range(m):
        root = np.sqrt(ws.axial[c])
        for i in range(gain.shape[0]):
            gain[i, c] = -root * ws.columns[i, c]
    _finish_columns(ws, gain)


@kernel(error_model="numpy")
def tension_gain(ws: Workspace, gain: Array) -> Array:
    """Return ∂λ/∂d = C (I + G ∂q/∂d) (m, m) [N/m] for the ``gain`` of :func:`drive_gain`."""
    m = ws.axial.shape[0]
    out = np.zeros((m, m))
    for c in range(m):
        for k in range(m):
            total = 1.0 if c == k else 0.0
            for i in range(gain.shape[0]):
                total += ws.G[c, 3 * FIXED + i] * gain[i, k]
            out[c, k] = ws.axial[c] * total
    return out
