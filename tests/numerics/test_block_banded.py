"""Block-banded Cholesky against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.numerics import block_banded, block_solves

SIZES = st.tuples(st.integers(1, 6), st.integers(1, 3), st.sampled_from([1, 2, 12]), st.integers(1, 7))
SEEDS = st.integers(0, 10**6)


def banded(n, width, b, rng):
    """Random positive definite matrix of n blocks of size b: dense, and in block-banded storage."""
    blocks = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= width
    dense = rng.standard_normal((n * b, n * b)) * np.kron(blocks, np.ones((b, b)))
    dense = dense + dense.T
    dense += np.diag(np.abs(dense).sum(axis=1) + 0.1 + rng.random(n * b))
    return dense, stored(dense, n, width, b)


def stored(dense, n, width, b):
    """Upper block bands; what must never be read (below the diagonal, beyond the matrix) is NaN."""
    A = np.full((n, width + 1, b, b), np.nan)
    for j in range(n):
        for d in range(min(width + 1, n - j)):
            A[j, d] = dense[j * b : (j + 1) * b, (j + d) * b : (j + d + 1) * b]
        A[j, 0][np.tril_indices(b, -1)] = np.nan
    return A


@given(size=SIZES, seed=SEEDS)
def test_the_solution_is_that_of_the_dense_matrix(size, seed):
    (n, width, b, r), rng = size, np.random.default_rng(seed)
    dense, A = banded(n, width, b, rng)
    X = rng.standard_normal((n * b, r))
    expected = np.linalg.solve(dense, X)
    assert block_banded.factor(A)
    block_banded.solve(A, X)
    np.testing.assert_allclose(X, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@given(size=SIZES, seed=SEEDS)
def test_the_factor_is_that_of_the_dense_matrix_and_halves_of_the_solve_use_it(size, seed):
    (n, width, b, r), rng = size, np.random.default_rng(seed)
    dense, A = banded(n, width, b, rng)
    lower = np.linalg.cholesky(dense)
    assert block_banded.factor(A)
    for j in range(n):
        for d in range(min(width + 1, n - j)):
            block = lower.T[j * b : (j + 1) * b, (j + d) * b : (j + d + 1) * b]
            rows, columns = np.triu_indices(b) if d == 0 else np.indices((b, b)).reshape(2, -1)
            np.testing.assert_allclose(A[j, d][rows, columns], block[rows, columns], atol=1e-12 * n * b)
    X = rng.standard_normal((n * b, r))
    forward, backward = X.copy(), X.copy()
    block_banded.solve_forward(A, forward)
    block_banded.solve_backward(A, backward)
    np.testing.assert_allclose(lower @ forward, X, atol=1e-11)
    np.testing.assert_allclose(lower.T @ backward, X, atol=1e-11)


@given(size=SIZES, seed=SEEDS)
def test_products_are_those_of_the_dense_matrix(size, seed):
    (n, width, b, r), rng = size, np.random.default_rng(seed)
    dense, A = banded(n, width, b, rng)
    X, out = rng.standard_normal((n * b, r)), np.full((n * b, r), np.nan)
    block_banded.multiply_columns(A, X, out)
    np.testing.assert_allclose(out, dense @ X, atol=1e-12 * np.abs(dense).sum())
    np.testing.assert_allclose(block_banded.to_dense(A), dense, atol=0)


@pytest.mark.parametrize("width", [1, 2, 3])
@pytest.mark.parametrize("place", [0, 17, 47])
def test_a_matrix_with_a_negative_direction_is_refused(width, place):
    dense, _ = banded(4, width, 12, np.random.default_rng(place))
    values, vectors = np.linalg.eigh(dense)
    dense[place, place] -= 1.0001 / np.sum(vectors[place] ** 2 / values)
    assert np.sum(np.linalg.eigvalsh(dense) < 0.0) == 1
    assert not block_banded.factor(stored(dense, 4, width, 12))


def test_a_matrix_that_is_not_finite_is_refused():
    dense, _ = banded(3, 1, 12, np.random.default_rng(1))
    dense[20, 20] = np.nan
    assert not block_banded.factor(stored(dense, 3, 1, 12))


def test_a_singular_matrix_is_refused():
    assert not block_banded.factor(np.zeros((3, 2, 12, 12)))


@given(size=SIZES, seed=SEEDS)
def test_vectors_and_many_columns_are_solved_for_alike(size, seed):
    (n, width, b, r), rng = size, np.random.default_rng(seed)
    _, U = banded(n, width, b, rng)
    assert block_banded.factor(U)
    halves = [
        (block_banded.solve_forward, block_solves.forward_columns, block_solves.forward_vector),
        (block_banded.solve_backward, block_solves.backward_columns, block_solves.backward_vector),
    ]
    for plain, columns, vector in halves:
        X = rng.standard_normal((n * b, r))
        expected, many, one = X.copy(), X.copy(), X[:, 0].copy()
        plain(U, expected)
        columns(U, many)
        vector(U, one)
        np.testing.assert_allclose(many, expected, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(one, expected[:, 0], rtol=1e-9, atol=1e-12)
