"""Laws of the search for the largest eigenvalues: what is known exactly is found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.numerics.spectrum import DENSE, derivative, jacobian, largest_eigenvalues


def matrix(size, radius, seed):
    """A non-normal matrix of known spectral radius, most of its eigenvalues close below it."""
    rng = np.random.default_rng(seed)
    magnitude = radius * np.concatenate([[1.0], rng.uniform(0.5, 0.99, size - 1)])
    T = np.triu(rng.standard_normal((size, size)) / size, 1) + np.diag(magnitude)
    Q, _ = np.linalg.qr(rng.standard_normal((size, size)))
    return Q @ T @ Q.T


def test_a_jacobian_is_written_out_column_by_column():
    A = matrix(5, 1.0, 0)
    np.testing.assert_allclose(jacobian(lambda x: A @ x + 3.0, 5, 1e-3), A, atol=1e-12)


@given(st.integers(1, DENSE), st.floats(0.1, 3.0), st.integers(0, 10))
def test_small_maps_are_exact(size, radius, seed):
    A = matrix(size, radius, seed)
    found = largest_eigenvalues(lambda x: A @ x, np.ones(size), 2)
    assert found.converged
    assert found.radius == pytest.approx(radius, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("size", [DENSE + 1, 90, 200])
@pytest.mark.parametrize("radius", [0.98, 1.05])
def test_large_maps_are_found_by_products_alone(size, radius):
    A = matrix(size, radius, 1)
    found = largest_eigenvalues(lambda x: A @ x, np.random.default_rng(0).standard_normal(size))
    assert found.converged
    assert found.radius == pytest.approx(radius, rel=1e-4)
    expected = np.sort(np.abs(np.linalg.eigvals(A)))[::-1][:4]
    np.testing.assert_allclose(np.abs(found.eigenvalues), expected, rtol=1e-4)


def test_a_pair_keeps_its_angle():
    angle, size = 0.3, 60
    A = np.zeros((size, size))
    A[:2, :2] = 0.99 * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    A[2:, 2:] = np.diag(np.linspace(0.1, 0.9, size - 2))
    found = largest_eigenvalues(lambda x: A @ x, np.ones(size))
    assert np.abs(np.angle(found.eigenvalues[:2])) == pytest.approx([angle, angle], rel=1e-4)


@pytest.mark.parametrize(("central", "order"), [(False, 1), (True, 2)])
def test_the_error_of_a_difference_falls_with_its_order(central, order):
    direction = np.array([1.0, -2.0, 0.5])

    def apply(x):
        return np.exp(x) + x[::-1] * x

    exact = direction + 0.0 * direction  # d(x reversed times x) is 0 at 0
    error = [
        np.linalg.norm(derivative(apply, 3, step, central=central)(direction) - exact)
        for step in (2e-2, 1e-2)
    ]
    assert error[0] / error[1] == pytest.approx(2.0**order, rel=0.05)


def test_a_map_that_is_not_finite_gives_no_radius():
    found = largest_eigenvalues(lambda x: np.full(3, np.nan), np.ones(3), 1)
    assert not found.converged
    assert np.isnan(found.radius)
