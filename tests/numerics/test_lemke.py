"""Lemke's method where it is hard: contradictions, degenerate linear programs, cycling, rounding errors."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.numerics import lcp, lemke
from tcrctl.numerics.lcp import lcp_residuals, solve_lcp


def test_contradicting_constraints_end_on_a_ray():
    rng = np.random.default_rng(3)
    for _ in range(500):
        n = int(rng.integers(2, 30))
        y = np.abs(rng.normal(size=n))  # y >= 0 with y'M = 0 and y'q < 0: y'w cannot be >= 0
        root = rng.normal(size=(n, max(1, n // 3)))
        root -= np.outer(y, y @ root) / (y @ y)
        q = rng.normal(size=n)
        q -= y * (y @ q + 0.1) / (y @ y)
        z, _, _, status = solve_lcp(root @ root.T, q)
        assert status == lcp.RAY
        assert lcp_residuals(root @ root.T, q, z)[0] > 0.0


def linear_program(A, b, cost):
    """LCP of min cost'x, A x <= b, x >= 0; its matrix is skew: semidefinite with a zero diagonal."""
    rows, columns = A.shape
    M = np.block([[np.zeros((columns, columns)), A.T], [-A, np.zeros((rows, rows))]])
    return M, np.r_[cost, b].astype(float)


def test_beales_cycling_program_ends_at_its_optimum():
    A = np.array([[0.25, -8.0, -1.0, 9.0], [0.5, -12.0, -0.5, 3.0], [0.0, 0.0, 1.0, 0.0]])
    M, q = linear_program(A, [0.0, 0.0, 1.0], [-0.75, 20.0, -0.5, 6.0])
    z, _, _, status = solve_lcp(M, q)
    assert status == lcp.SOLVED
    assert q[:4] @ z[:4] == pytest.approx(-1.25)


def test_kostrevas_cycling_problem_ends_at_its_solution():
    M = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]])
    z, _, _, status = solve_lcp(M, -np.ones(3))
    assert status == lcp.SOLVED
    np.testing.assert_allclose(z, 1 / 3)


def test_degenerate_linear_programs_reach_the_value_of_their_dual():
    rng = np.random.default_rng(4)
    for _ in range(300):
        rows, columns = rng.integers(1, 15, 2)
        A = rng.integers(-3, 4, size=(rows, columns)) * 10.0 ** rng.uniform(-3, 3)
        b = A @ rng.integers(0, 3, columns) + np.abs(A).max() * rng.integers(0, 2, rows)
        cost = -A.T @ rng.integers(0, 3, rows) + np.abs(A).max() * rng.integers(0, 2, columns)
        z, w, _, status = solve_lcp(*linear_program(A, b, cost))
        value, dual = cost @ z[:columns], -b @ z[columns:]
        assert status == lcp.SOLVED
        assert w.min() > -1e-10 * np.abs(A).max()
        assert value == pytest.approx(dual, rel=1e-9, abs=1e-9 * np.abs(A).max())


@pytest.mark.parametrize(("n", "status"), [(2, lcp.SOLVED), (7, lcp.SOLVED), (12, lcp.PIVOT_LIMIT)])
def test_murtys_problem_that_doubles_the_pivots_with_each_row_is_cut_off(n, status):
    M = np.eye(n) + 2.0 * np.tril(np.ones((n, n)), -1)
    _, _, pivots, reached = solve_lcp(M, -np.ones(n))
    assert reached == status
    assert pivots == (2**n if status == lcp.SOLVED else 50 * n)


def test_ratios_that_differ_by_rounding_are_a_tie_for_the_next_column_to_decide():
    tableau = np.array([[1.0 + np.finfo(float).eps, 1.0], [0.0, 1.0], [1.0, 0.0]])
    column, noise, basis = np.ones(2), np.zeros(2), np.array([0, 1])
    assert lemke._leaving_row(tableau, column, noise, basis) == 0
    tableau[1] = [1.0, 0.0]
    assert lemke._leaving_row(tableau, column, noise, basis) == 1
    assert lemke._leaving_row(tableau, -column, noise, basis) == -1


def test_the_basic_solution_is_exact_even_if_the_tableau_is_not():
    rng = np.random.default_rng(5)
    root, p = rng.normal(size=(12, 12)), rng.normal(size=12)
    C = root @ root.T + np.eye(12)
    tableau, basis, _, status = lemke.pivot_to_solution(C, p)
    assert status == lcp.SOLVED
    spoilt = tableau * (1.0 + 1e-8 * rng.normal(size=tableau.shape))
    columns = [np.eye(12)[i] if i < 12 else -C[i - 12] for i in basis]
    np.testing.assert_allclose(lemke.refined(C, p, spoilt, basis) @ np.array(columns), p, rtol=0, atol=1e-14)
