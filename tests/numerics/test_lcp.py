"""The LCP solver against an independent QP solver, enumeration, and the laws of the problem."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import daqp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcrctl.numerics import lcp
from tcrctl.numerics.lcp import lcp_residuals, lcp_sentence, solve_lcp

EXACT = {"primal_tol": 1e-12, "dual_tol": 1e-13, "pivot_tol": 1e-12, "zero_tol": 1e-14}
UNBOUNDED = 1e30


@dataclass(frozen=True)
class BoxQP:
    """min 1/2 u'Hu + g'u, lower <= u <= upper, A u + slack >= b at the cost 1/2 rho slack^2 per row."""

    H: np.ndarray
    g: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    A: np.ndarray
    b: np.ndarray
    rho: np.ndarray

    def as_lcp(self):
        """Rows: u >= lower, -u >= -upper, A u + k/rho >= b; u = H^-1 (rows'k - g)."""
        eye = np.eye(self.g.size)
        rows = np.vstack([eye, -eye, self.A])
        softness = np.r_[np.zeros(2 * self.g.size), 1.0 / self.rho]
        inverse = np.linalg.inv(self.H)
        M = rows @ inverse @ rows.T + np.diag(softness)
        q = -rows @ inverse @ self.g - np.r_[self.lower, -self.upper, self.b]
        return M, q, lambda z: inverse @ (rows.T @ z - self.g)

    def by_daqp(self):
        """The same with explicit slack variables, in units that suit the other solver."""
        m, soft = self.A.shape[1], self.b.size
        length = np.abs(self.upper - self.lower).max()
        energy = np.linalg.norm(self.H, 2) * length**2
        H = np.eye(m + soft)
        H[:m, :m] = self.H * length**2 / energy
        A = np.hstack([self.A * length, np.diag(np.sqrt(energy / self.rho))])
        size = np.linalg.norm(A, axis=1)
        solver = daqp.Model()
        solver.setup(
            H,
            np.r_[self.g * length / energy, np.zeros(soft)],
            A / size[:, None],
            np.r_[self.upper / length, np.full(2 * soft, UNBOUNDED)],
            np.r_[self.lower / length, np.full(soft, -UNBOUNDED), self.b / size],
            np.zeros(m + 2 * soft, np.int32),
        )
        solver.settings = EXACT
        x, _, flag, _ = solver.solve()
        assert flag == 1
        return x[:m] * length


def random_qp(rng, condition, kind):
    """A QP in mixed units whose optimum lies anywhere, exactly on constraints, or on a grid with ties."""
    m = int(rng.integers(1, 13))
    soft = int(rng.integers(0, 2 * m + 1))
    basis = np.linalg.qr(rng.normal(size=(m, m)))[0]
    H = (basis * np.geomspace(1.0, 1.0 / condition, m)) @ basis.T * 10.0 ** rng.uniform(-4, 4)
    H = (H + H.T) / 2
    upper = np.full(m, 0.05)
    free = rng.uniform(-0.1, 0.1, m)
    if kind == "grid":
        free = np.round(free * 20) / 20
    A = rng.normal(size=(soft, m)) * 10.0 ** rng.uniform(-2, 3)
    inside = np.clip(free, -upper, upper)
    b = A @ inside
    if kind == "generic":
        b = b + np.linalg.norm(A, axis=1) * rng.uniform(-0.05, 0.03, soft)
    if kind == "on constraints":
        free = inside
    rho = 10.0 ** rng.uniform(-2, 3) / np.maximum(np.einsum("ij,jk,ik->i", A, np.linalg.inv(H), A), 1e-30)
    return BoxQP(H, -H @ free, -upper, upper, A, b, rho)


def scaled_residual(M, q, z):
    """Largest of the residuals with rows of unit diagonal, the largest entry of q being 1."""
    size = np.sqrt(np.diag(M))
    M, q, z = M / np.outer(size, size), q / size, z * size
    largest = np.abs(q).max()
    below_w, below_z, product = lcp_residuals(M, q / largest, z / largest)
    return max(below_w, below_z, product / max(1.0, z.max() / largest))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["generic", "on constraints", "grid"])
@pytest.mark.parametrize("condition", [1e0, 1e2, 1e4, 1e6, 1e8])
def test_box_qps_with_soft_rows_have_the_optimum_an_independent_solver_finds(condition, kind):
    rng = np.random.default_rng([int(condition), len(kind)])
    for _ in range(200):
        qp = random_qp(rng, condition, kind)
        M, q, control = qp.as_lcp()
        z, w, _, status = solve_lcp(M, q)
        u, other = control(z), qp.by_daqp()
        assert status == lcp.SOLVED
        np.testing.assert_allclose(w, M @ z + q, rtol=0, atol=1e-13 * (np.abs(M) @ z + np.abs(q)).max())
        assert scaled_residual(M, q, z) < 1e-12 + 1e-15 * condition
        assert max((qp.lower - u).max(), (u - qp.upper).max()) < 1e-12 + 1e-15 * condition
        energy = max(u @ qp.H @ u, qp.g @ np.linalg.solve(qp.H, qp.g), 1e-30)
        assert (u - other) @ qp.H @ (u - other) < (1e-13 * condition) ** 2 * energy


def test_a_box_of_no_width_pins_the_input():
    rng = np.random.default_rng(7)
    for _ in range(200):
        qp = random_qp(rng, 1e3, "generic")
        pinned = rng.random(qp.g.size) < 0.5
        qp = BoxQP(qp.H, qp.g, np.where(pinned, qp.upper, qp.lower), qp.upper, qp.A, qp.b, qp.rho)
        M, q, control = qp.as_lcp()
        z, _, _, status = solve_lcp(M, q)
        assert status == lcp.SOLVED
        np.testing.assert_allclose(control(z)[pinned], qp.upper[pinned], rtol=1e-9)


def coinciding_rows(rng, n, m, condition):
    """Hard rows, most of which meet in one corner: H, g, rows, b and the corner, a feasible point."""
    basis = np.linalg.qr(rng.normal(size=(m, m)))[0]
    H = (basis * np.geomspace(1.0, 1.0 / condition, m)) @ basis.T
    rows = np.vstack([np.eye(m), -np.eye(m), rng.integers(-2, 3, size=(n - 2 * m, m))])
    corner = rng.integers(-1, 2, m)
    b = np.r_[-np.ones(2 * m), rows[2 * m :] @ corner - rng.integers(0, 2, n - 2 * m)]
    return H, -H @ (corner + rng.integers(-1, 2, m)), rows, b, corner


@pytest.mark.parametrize("condition", [1e0, 1e3, 1e6])
@pytest.mark.parametrize(("n", "m", "count"), [(24, 6, 60), (60, 12, 30), (120, 30, 10)])
def test_many_coinciding_hard_rows_in_mixed_units_are_solved(n, m, count, condition):
    rng = np.random.default_rng([n, int(condition)])
    for _ in range(count):
        H, g, rows, b, corner = coinciding_rows(rng, n, m, condition)
        unit, inverse = 10.0 ** rng.uniform(-3, 3, n), np.linalg.inv(H)
        M, q = rows @ inverse @ rows.T * np.outer(unit, unit), (-rows @ inverse @ g - b) * unit
        z, _, _, status = solve_lcp(M, q)
        u = inverse @ (rows.T @ (unit * z) - g)
        assert status == lcp.SOLVED
        assert (rows @ u - b).min() > -1e-12 * condition
        assert u @ H @ u / 2 + g @ u <= corner @ H @ corner / 2 + g @ corner + 1e-12 * condition


def complementary_solutions(M, q):
    """All solutions, by trying each of the 2^n complementary bases."""
    n = q.size
    for support in itertools.product([False, True], repeat=n):
        active = np.array(support)
        z = np.zeros(n)
        z[active] = np.linalg.solve(M[np.ix_(active, active)], -q[active])
        w = M @ z + q
        if z.min() >= 0.0 and w[~active].min(initial=0.0) >= 0.0:
            yield z


@pytest.mark.slow
@pytest.mark.parametrize("n", range(1, 7))
def test_p_matrices_have_the_one_solution_that_enumeration_finds(n):
    rng = np.random.default_rng(n)
    for _ in range(40):
        root, skew = rng.normal(size=(2, n, n))
        definite = root @ root.T + 0.1 * np.eye(n) + skew - skew.T
        triangular = np.diag(rng.uniform(0.5, 2.0, n)) + np.tril(3.0 * skew, -1)
        for M in (definite, triangular):
            q = rng.normal(size=n)
            (expected,) = complementary_solutions(M, q)
            z, _, _, status = solve_lcp(M, q)
            assert status == lcp.SOLVED
            np.testing.assert_allclose(z, expected, rtol=1e-9, atol=1e-9)


def test_a_nonnegative_q_is_solved_by_zero_without_a_pivot():
    rng = np.random.default_rng(1)
    q = np.r_[0.0, rng.random(9)]
    z, w, pivots, status = solve_lcp(rng.normal(size=(10, 10)), q)
    assert (pivots, status) == (0, lcp.SOLVED)
    assert not z.any()
    assert np.array_equal(w, q)


@pytest.mark.parametrize("n", [4, 8, 12, 16])
def test_success_is_only_claimed_where_the_residual_is_small(n):
    i = np.arange(n)
    hilbert = 1.0 / (1.0 + i[:, None] + i)
    claims = []
    for seed in range(50):
        q = np.random.default_rng(seed).normal(size=n)
        z, _, _, status = solve_lcp(hilbert, q)
        claims.append((status, scaled_residual(hilbert, q, z)))
    assert all(residual < 1e-5 for status, residual in claims if status == lcp.SOLVED)
    assert n > 4 or all(status == lcp.SOLVED for status, _ in claims)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_entries_that_are_not_finite_are_refused_by_code(bad):
    M, q = np.eye(3), -np.ones(3)
    for spoilt in (M, q):
        spoilt.flat[1] = bad
        z, w, pivots, status = solve_lcp(M, q)
        assert (pivots, status) == (0, lcp.BAD_INPUT)
        assert np.isnan(z).all()
        assert np.isnan(w).all()
        assert np.isnan(lcp_residuals(M, q, z)).all()
        spoilt.flat[1] = 0.0


@pytest.mark.parametrize("shape", [(2, 3), (3, 2), (4, 4), (0, 0)])
def test_a_matrix_that_does_not_fit_is_refused_by_code(shape):
    assert solve_lcp(np.ones(shape), -np.ones(3))[3] == lcp.BAD_INPUT


def test_an_empty_problem_is_solved():
    z, w, pivots, status = solve_lcp(np.empty((0, 0)), np.empty(0))
    assert (z.size, w.size, pivots, status) == (0, 0, 0, lcp.SOLVED)


@pytest.mark.slow
def test_frozen_arguments_of_any_layout_give_the_same_answer_and_stay_unchanged():
    M, q = np.array([[2.0, 1.0], [0.0, 2.0]]), np.array([-1.0, -3.0])
    expected = solve_lcp(M, q)
    frozen, vector = np.asfortranarray(M), q.copy()
    frozen.flags.writeable = vector.flags.writeable = False
    got = solve_lcp(frozen, vector)
    assert [np.array_equal(a, b) for a, b in zip(got, expected, strict=True)] == [True] * 4
    assert np.array_equal(M, frozen)
    assert np.array_equal(q, vector)


def test_residuals_are_those_of_the_definition():
    M, q = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([-10.0, 1.0])
    assert lcp_residuals(M, q, np.array([2.0, -1.0])) == (10.0, 1.0, 20.0)  # w = (-10, 3)
    assert lcp_residuals(M, q, np.array([10.0, 0.0])) == (0.0, 0.0, 0.0)  # w = (0, 31)


def test_every_code_has_its_own_sentence():
    codes = [lcp.SOLVED, lcp.RAY, lcp.PIVOT_LIMIT, lcp.INACCURATE, lcp.BAD_INPUT]
    assert len({lcp_sentence(code) for code in codes}) == len(codes)
    with pytest.raises(KeyError):
        lcp_sentence(len(codes))


seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)
kinds = st.sampled_from(["generic", "on constraints", "grid"])


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seeds, kinds, st.floats(1e-6, 1e6))
def test_a_common_factor_of_m_and_q_leaves_z_as_it_is(rng, kind, factor):
    M, q, control = random_qp(rng, 1e2, kind).as_lcp()
    u, scaled = control(solve_lcp(M, q)[0]), control(solve_lcp(factor * M, factor * q)[0])
    np.testing.assert_allclose(scaled, u, rtol=0, atol=1e-11)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seeds, kinds)
def test_units_of_the_rows_do_not_matter_and_powers_of_two_not_even_to_rounding(rng, kind):
    M, q, _ = random_qp(rng, 1e2, kind).as_lcp()
    unit = 2.0 ** rng.integers(-20, 21, q.size)
    z, w, pivots, _ = solve_lcp(M, q)
    scaled_z, scaled_w, scaled_pivots, _ = solve_lcp(M * np.outer(unit, unit), q * unit)
    assert pivots == scaled_pivots
    assert np.array_equal(z, scaled_z * unit)
    assert np.array_equal(w * unit, scaled_w)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seeds, kinds)
def test_the_order_of_the_rows_does_not_change_the_input(rng, kind):
    M, q, control = random_qp(rng, 1e2, kind).as_lcp()
    order = rng.permutation(q.size)
    z = np.empty(q.size)
    z[order] = solve_lcp(M[np.ix_(order, order)], q[order])[0]
    np.testing.assert_allclose(control(z), control(solve_lcp(M, q)[0]), rtol=0, atol=1e-11)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seeds, kinds)
def test_writing_every_row_twice_does_not_change_the_slack(rng, kind):
    qp = random_qp(rng, 1e2, kind)
    M, q, _ = BoxQP(qp.H, qp.g, qp.lower, qp.upper, qp.A[:0], qp.b[:0], qp.rho[:0]).as_lcp()
    w = solve_lcp(M, q)[1]
    _, doubled, _, status = solve_lcp(np.kron(np.ones((2, 2)), M), np.r_[q, q])
    assert status == lcp.SOLVED
    np.testing.assert_allclose(doubled, np.r_[w, w], rtol=0, atol=1e-11)
