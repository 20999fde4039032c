"""Solves with a factor of ``block_banded`` for one vector, and for columns so many that their products pay.

From half a dozen columns on, the library's product of a block with them takes a fifth of the time of compiled
loops, whose vectors are too short. One column is no columns of length one: it is kept in a row of memory.
"""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.block_banded import solve_transposed, solve_upper
from tcrctl.numerics.kernel import part
from tcrctl.signals import Array


@part(error_model="numpy")
def _subtract(target: Array, product: Array) -> None:
    """Subtract a product from rows of columns, both (b, r)."""
    for i in range(target.shape[0]):
        for c in range(target.shape[1]):
            target[i, c] -= product[i, c]


@part(error_model="numpy")
def forward_columns(U: Array, X: Array) -> None:
    """Overwrite columns ``X`` (n b, r) by U'^-1 X."""
    n, bands, b = U.shape[0], U.shape[1], U.shape[2]
    product = np.empty((b, X.shape[1]))
    for j in range(n):
        here = X[j * b : (j + 1) * b]
        solve_transposed(U[j, 0], here)
        for d in range(1, min(bands, n - j)):
            np.dot(U[j, d].T, here, product)
            _subtract(X[(j + d) * b : (j + d + 1) * b], product)


@part(error_model="numpy")
def backward_columns(U: Array, X: Array) -> None:
    """Overwrite columns ``X`` (n b, r) by U^-1 X."""
    n, bands, b = U.shape[0], U.shape[1], U.shape[2]
    product = np.empty((b, X.shape[1]))
    for j in range(n - 1, -1, -1):
        here = X[j * b : (j + 1) * b]
        for d in range(1, min(bands, n - j)):
            np.dot(U[j, d], X[(j + d) * b : (j + d + 1) * b], product)
            _subtract(here, product)
        solve_upper(U[j, 0], here)


@part(error_model="numpy")
def transposed_vector(U: Array, x: Array) -> None:
    """Overwrite ``x`` (b,) by U'^-1 x with U upper triangular (b, b)."""
    for k in range(x.shape[0]):
        value = x[k] * (1.0 / U[k, k])
        x[k] = value
        for i in range(k + 1, x.shape[0]):
            x[i] -= U[k, i] * value


@part(error_model="numpy")
def upper_vector(U: Array, x: Array) -> None:
    """Overwrite ``x`` (b,) by U^-1 x with U upper triangular (b, b)."""
    for k in range(x.shape[0] - 1, -1, -1):
        value = x[k]
        for i in range(k + 1, x.shape[0]):
            value -= U[k, i] * x[i]
        x[k] = value * (1.0 / U[k, k])


@part(error_model="numpy")
def forward_vector(U: Array, x: Array) -> None:
    """Overwrite ``x`` (n b,) by U'^-1 x."""
    n, bands, b = U.shape[0], U.shape[1], U.shape[2]
    for j in range(n):
        here = x[j * b : (j + 1) * b]
        transposed_vector(U[j, 0], here)
        for d in range(1, min(bands, n - j)):
            there, block = x[(j + d) * b : (j + d + 1) * b], U[j, d]
            for k in range(b):
                for i in range(b):
                    there[i] -= block[k, i] * here[k]


@part(error_model="numpy")
def backward_vector(U: Array, x: Array) -> None:
    """Overwrite ``x`` (n b,) by U^-1 x."""
    n, bands, b = U.shape[0], U.shape[1], U.shape[2]
    for j in range(n - 1, -1, -1):
        here = x[j * b : (j + 1) * b]
        for d in range(1, min(bands, n - j)):
            there, block = x[(j + d) * b : (j + d + 1) * b], U[j, d]
            for i in range(b):
                value = here[i]
                for k in range(b):
                    value -= block[i, k] * there[k]
                here[i] = value
        upper_vector(U[j, 0], here)
