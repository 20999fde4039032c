"""Laws of orthonormal columns: they are those of Gram-Schmidt, and dependent ones become zero."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.numerics.orthonormal import DEPENDENT, orthonormalise

SEEDS = st.integers(0, 10**6)
N, R = 40, 9


def columns(seed, alike):
    """Mass matrix (N, N) and columns (N, R) of unlike lengths that differ from one another by a part ``alike``."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((N, N))
    V = rng.standard_normal((N, 1)) + alike * rng.standard_normal((N, R))
    return root @ root.T / N + np.eye(N), V * 10.0 ** rng.uniform(-6, 6, R)


def gram_schmidt(M, V):
    """Orthonormal columns in the order of V, one after the other, each twice."""
    out = np.zeros_like(V)
    for j in range(V.shape[1]):
        v = V[:, j].copy()
        for _ in range(2):
            v -= out[:, :j] @ (out[:, :j].T @ (M @ v))
        out[:, j] = v / np.sqrt(v @ M @ v)
    return out


@given(seed=SEEDS, alike=st.sampled_from([1.0, 1e-2, 1e-4]))
def test_columns_are_those_of_gram_schmidt(seed, alike):
    M, V = columns(seed, alike)
    before, MV = V.copy(), M @ V
    T = orthonormalise(V, MV)
    np.testing.assert_allclose(V.T @ M @ V, np.eye(R), atol=1e-10)
    np.testing.assert_allclose(MV, M @ V, atol=1e-7)
    np.testing.assert_allclose(before @ T, V, atol=1e-7)
    np.testing.assert_allclose(V, gram_schmidt(M, before), atol=1e-7)


@pytest.mark.parametrize("kept", [0.0, 0.1 * DEPENDENT])
@pytest.mark.parametrize("j", [1, 4, R - 1])
def test_a_dependent_column_becomes_zero_and_the_others_do_as_without_it(kept, j):
    M, V = columns(1, 1.0)
    rng = np.random.default_rng(2)
    without = np.delete(V, j, axis=1)
    V[:, j] = V[:, :j] @ rng.standard_normal(j)
    V[:, j] += kept * np.linalg.norm(V[:, j]) / np.sqrt(N) * rng.standard_normal(N)
    orthonormalise(V, M @ V)
    orthonormalise(without, M @ without)
    assert not V[:, j].any()
    np.testing.assert_allclose(np.delete(V, j, axis=1), without, atol=1e-9)
