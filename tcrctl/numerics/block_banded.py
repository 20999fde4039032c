"""Cholesky factorisation and solves for symmetric block-banded matrices.

A robot of n modules gives an n x n block matrix with dense blocks on the diagonal and on w upper block
diagonals (w = 1, block tridiagonal, unless a spring or cable skips modules). Storage: ``A[j, d]`` is block
(j, j + d) of the upper triangle, shape (n, w + 1, b, b); only the upper triangle of ``A[j, 0]`` is read.
All inner loops run along rows, so that the compiler vectorises them. Source: [GVL13] Sec. 4.3.
"""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array

#: Doubles in a vector register: columns are quickest in multiples of it, and products take as many rows at once.
LANES = 4


@kernel(error_model="numpy")
def padded(count: int) -> int:
    """Return the number of columns to allocate for ``count`` right-hand sides."""
    return count + (LANES - count % LANES) % LANES


@part(error_model="numpy")
def factor_diagonal(block: Array) -> bool:
    """Overwrite the upper triangle of ``block`` (b, b) by U with block = U'U; False if it is not positive."""
    b = block.shape[0]
    for k in range(b):
        pivot = block[k, k]
        if not pivot > 0.0:  # also catches NaN
            return False
        scale = 1.0 / np.sqrt(pivot)
        for c in range(k, b):
            block[k, c] *= scale
        for r in range(k + 1, b):
            factor = block[k, r]
            if factor != 0.0:
                for c in range(r, b):
                    block[r, c] -= factor * block[k, c]
    return True


@part(error_model="numpy")
def solve_transposed(U: Array, X: Array) -> None:
    """Overwrite ``X`` (b, r) by U'^-1 X with U upper triangular (b, b)."""
    b, r = X.shape
    for k in range(b):
        inverse = 1.0 / U[k, k]
        for c in range(r):
            X[k, c] *= inverse
        for i in range(k + 1, b):
            factor = U[k, i]
            if factor != 0.0:
                for c in range(r):
                    X[i, c] -= factor * X[k, c]


@part(error_model="numpy")
def solve_upper(U: Array, X: Array) -> None:
    """Overwrite ``X`` (b, r) by U^-1 X with U upper triangular (b, b)."""
    b, r = X.shape
    for k in range(b - 1, -1, -1):
        for i in range(k + 1, b):
            factor = U[k, i]
            if factor != 0.0:
                for c in range(r):
                    X[k, c] -= factor * X[i, c]
        inverse = 1.0 / U[k, k]
        for c in range(r):
            X[k, c] *= inverse


@part(error_model="numpy")
def _subtract_transposed_product(target: Array, left: Array, right: Array) -> None:
    """Subtract left' right from ``target``, all row-major.

    Four rows at a time: an entry of ``target`` is loaded and stored once for four, and the order of the sum stays.
    """
    rows, cols = target.shape
    whole = left.shape[0] - left.shape[0] % LANES
    for k in range(0, whole, LANES):
        for r in range(rows):
            f0, f1, f2, f3 = left[k, r], left[k + 1, r], left[k + 2, r], left[k + 3, r]
            for c in range(cols):
                three = ((target[r, c] - f0 * right[k, c]) - f1 * right[k + 1, c]) - f2 * right[k + 2, c]
                target[r, c] = three - f3 * right[k + 3, c]
    for k in range(whole, left.shape[0]):
        for r in range(rows):
            for c in range(cols):
                target[r, c] -= left[k, r] * right[k, c]


@part(error_model="numpy")
def _subtract_product(target: Array, left: Array, right: Array) -> None:
    """Subtract left right from ``target``, all row-major."""
    _subtract_transposed_product(target, left.T, right)


@part(error_model="numpy")
def factor(A: Array) -> bool:
    """Overwrite ``A`` (n, w + 1, b, b) by its upper Cholesky factor.

    Args:
        A: Block-banded symmetric matrix in the storage of this module.

    Returns:
        False if the matrix is not positive definite; ``A`` is then of no use.
    """
    n, bands = A.shape[0], A.shape[1]
    for j in range(n):
        if not factor_diagonal(A[j, 0]):
            return False
        last = min(bands, n - j)
        for d in range(1, last):
            solve_transposed(A[j, 0], A[j, d])
        for d in range(1, last):
            for e in range(d, last):
                _subtract_transposed_product(A[j + d, e - d], A[j, d], A[j, e])
    return True


@part(error_model="numpy")
def solve_forward(U: Array, X: Array) -> None:
    """Overwrite the right-hand sides ``X`` (n b, r) by U'^-1 X, the first half of :func:`solve`."""
    n = U.shape[0]
    bands = U.shape[1]
    b = U.shape[2]
    for j in range(n):
        here = X[j * b : (j + 1) * b]
        solve_transposed(U[j, 0], here)
        for d in range(1, min(bands, n - j)):
            _subtract_transposed_product(X[(j + d) * b : (j + d + 1) * b], U[j, d], here)


@part(error_model="numpy")
def solve_backward(U: Array, X: Array) -> None:
    """Overwrite ``X`` (n b, r) by U^-1 X, the second half of :func:`solve`."""
    n = U.shape[0]
    bands = U.shape[1]
    b = U.shape[2]
    for j in range(n - 1, -1, -1):
        here = X[j * b : (j + 1) * b]
        for d in range(1, min(bands, n - j)):
            _subtract_product(here, U[j, d], X[(j + d) * b : (j + d + 1) * b])
        solve_upper(U[j, 0], here)


@part(error_model="numpy")
def solve(U: Array, X: Array) -> None:
    """Overwrite the right-hand sides by the solution of U'U x = rhs.

    Args:
        U: Factor made by :func:`factor` (n, w + 1, b, b).
        X: Right-hand sides, one per column (n b, r).
    """
    solve_forward(U, X)
    solve_backward(U, X)


@part(error_model="numpy")
def _add_block_products(block: Array, diagonal: bool, i: int, j: int, X: Array, out: Array) -> None:
    """Add the products of ``block`` at (i, j) and, off the diagonal, of its transpose at (j, i)."""
    b = block.shape[0]
    for r in range(b):
        for c in range(r if diagonal else 0, b):
            value = block[r, c]
            if value != 0.0:
                row, column = i * b + r, j * b + c
                for k in range(X.shape[1]):
                    out[row, k] += value * X[column, k]
                if row != column:
                    for k in range(X.shape[1]):
                        out[column, k] += value * X[row, k]


@part(error_model="numpy")
def multiply_columns(A: Array, X: Array, out: Array) -> None:
    """Fill out = A X for an unfactored block-banded matrix A (n, w + 1, b, b) and columns X (n b, r)."""
    out[:] = 0.0
    for j in range(A.shape[0]):
        for d in range(min(A.shape[1], A.shape[0] - j)):
            _add_block_products(A[j, d], d == 0, j, j + d, X, out)


@kernel(error_model="numpy")
def to_dense(A: Array) -> Array:
    """Return the dense symmetric matrix (n b, n b) of a block-banded one; for tests and small offline work."""
    size = A.shape[0] * A.shape[2]
    dense = np.empty((size, size))
    multiply_columns(A, np.eye(size), dense)
    return dense
