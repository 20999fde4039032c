"""Friction in the cable holes: capstan law, sticking, dissipation, and the chain against an independent solver."""

from __future__ import annotations

import itertools

import daqp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.rubbing import Chain, arc
from tcrctl.elements import rubbing_cable
from tcrctl.elements.rubbing_cable import Stretches

SEEDS = st.integers(0, 10**6)
EXACT = {"primal_tol": 1e-12, "dual_tol": 1e-12, "pivot_tol": 1e-13, "zero_tol": 1e-14}


def chain_problem(seed):
    """Random wanted tensions, stiffnesses and caps of one chain; some slack, some holes without friction."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 15))
    wanted = rng.normal(rng.choice([-3.0, 0.5, 5.0]), rng.choice([0.0, 0.3, 4.0]), n)
    stiffness = 10.0 ** rng.uniform(3.0, 5.0, n)
    cap = rng.choice([0.0, 0.02, 0.4, 30.0], n) * rng.random(n)
    return wanted, stiffness, cap


def by_daqp(wanted, stiffness, cap):
    """min sum (T - wanted)^2 / (2 k)  subject to  |T_i - T_(i+1)| <= F_i, T >= 0."""
    n, scale = wanted.size, stiffness.mean()
    H = np.diag(scale / stiffness)
    differences = (np.eye(n) - np.eye(n, k=1))[:-1]
    solver = daqp.Model()
    solver.setup(
        H,
        -scale / stiffness * wanted,
        differences,
        np.concatenate([np.full(n, 1e6), cap[:-1]]),
        np.concatenate([np.zeros(n), -cap[:-1]]),
        np.zeros(2 * n - 1, np.int32),
    )
    solver.settings = EXACT
    tension, _, flag, _ = solver.solve()
    assert flag == 1
    return tension


def by_chain(wanted, stiffness, cap):
    n = wanted.size
    s = Stretches(
        *(np.zeros(n), np.zeros((n, 3)), np.zeros(n), np.zeros(n), stiffness, wanted, np.zeros(n)),
        *(np.zeros((2, 4 * n + 4)), np.zeros(1, np.int64), np.zeros(1), np.zeros(1)),
    )
    rubbing_cable.solve_chain(s, cap, 0, n - 1)
    return s.tension


def cost(T, wanted, stiffness):
    return 0.5 * np.sum((T - wanted) ** 2 / stiffness)


@given(SEEDS)
def test_a_chain_is_solved_as_by_an_independent_solver(seed):
    wanted, stiffness, cap = chain_problem(seed)
    T, other = by_chain(wanted, stiffness, cap), by_daqp(wanted, stiffness, cap)
    assert T.min() >= 0.0
    assert np.all(np.abs(np.diff(T)) <= cap[:-1] + 1e-12 * (1.0 + T[:-1]))
    np.testing.assert_allclose(T, other, rtol=0, atol=1e-7 * (1.0 + np.abs(wanted).max()))
    assert cost(T, wanted, stiffness) <= cost(other, wanted, stiffness) * (1.0 + 1e-9) + 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.05, 0.3])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_cable_that_slides_everywhere_obeys_the_capstan_law(mu, direction):
    """T_n = T_0 exp(-mu sum phi) when pulled in, the other way round when paid out; error of first order."""
    errors = []
    for step in (4e-6, 2e-6, 1e-6):
        chain = Chain(arc(10.0), mu=mu)
        d, slides = 0.0, np.zeros(1, np.bool_)
        while not slides.all():
            d += direction * step
            slides = chain.step(d)
        for _ in range(20):
            d += direction * step
            assert chain.step(d).all()
        ratio = chain.tension[:-1] / chain.tension[1:]
        law = np.exp(direction * mu * chain.wraps())
        assert abs(np.log(ratio.prod()) - direction * mu * chain.wraps().sum()) < 2e-2
        errors.append(np.abs(ratio / law - 1.0).max())
    assert errors[-1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_the_least_wrap_and_the_drag_hold_a_straight_cable():
    straight = arc(0.0)
    free = Chain(straight, mu=0.2)
    assert free.step(1e-5).all()
    assert np.ptp(free.tension) < 1e-12
    wrapped, dragged = (
        Chain(straight, mu=0.2, least_wrap=np.radians(2.0)),
        Chain(straight, mu=0.0, drag=0.05),
    )
    for chain, cap in ((wrapped, 5.0 * np.expm1(0.2 * np.radians(2.0))), (dragged, 0.05)):
        alone = chain.slip.stiffness[0] * 2e-7  # growth of the first tension while everything sticks
        k = 0
        while not chain.step(k * 2e-7).any():
            k += 1
        assert k * alone == pytest.approx(cap, rel=0.1)
        while not chain.step(k * 2e-7).all():
            k += 1
        assert k * 2e-7 > 10 * cap / chain.slip.stiffness.max()
        np.testing.assert_allclose(chain.slip.cap[:-1], cap, rtol=0.1)


def test_after_a_reversal_the_holes_let_go_one_after_the_other_from_the_drive_on():
    chain, d, step = Chain(arc(8.0), mu=0.15), 0.0, 2e-6
    while not chain.step(d).all():
        d += step
    first = np.full(chain.tension.size - 1, -1)
    for k in range(4000):
        d -= step
        slides = chain.step(d)
        first[(first < 0) & slides] = k
        if (first >= 0).all():
            break
    assert (first >= 0).all()
    assert np.all(np.diff(first) > 0)


def cycle(chain, amplitude, count):
    """Work of the drive [J] in one cycle 0, +amplitude, -amplitude, 0 of so many steps."""
    ramp = np.linspace(0.0, 1.0, count // 4, endpoint=False)
    way = amplitude * np.concatenate([ramp, 1.0 - ramp, -ramp, ramp - 1.0, [0.0]])
    work, before = 0.0, chain.tension[0]
    for a, b in itertools.pairwise(way):
        chain.step(b)
        work += 0.5 * (before + chain.tension[0]) * (b - a)
        before = chain.tension[0]
    return work


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_without_friction_a_loop_costs_nothing_but_the_damper(damping):
    chain = Chain(arc(10.0), mu=0.0, damping=damping)
    work = cycle(chain, 1e-3, 400)
    assert chain.work == 0.0
    assert np.ptp(chain.tension) < 1e-9
    if damping == 0.0:
        assert abs(work) < 1e-15
    else:
        assert work > 0.0


def test_the_area_of_a_loop_is_the_heat_of_the_holes_and_does_not_depend_on_the_step():
    areas = []
    for count in (400, 800, 1600):
        chain = Chain(arc(10.0), mu=0.1)
        cycle(chain, 1e-3, count)
        before = chain.work
        areas.append(cycle(chain, 1e-3, count))
        assert areas[-1] > 0.0
        assert chain.work - before == pytest.approx(areas[-1], rel=40.0 / count)
    assert areas[1] == pytest.approx(areas[2], rel=0.01)
    assert abs(areas[1] - areas[2]) < 0.75 * abs(areas[0] - areas[1])


@given(SEEDS, st.sampled_from([0.0, 0.05, 0.3, 2.0]), st.sampled_from([0.0, 1.0]))
def test_whatever_happens_friction_takes_energy_and_no_cable_is_lost(seed, mu, damping):
    rng = np.random.default_rng(seed)
    q = arc(rng.uniform(0.0, 25.0))
    chain = Chain(q, mu=mu, least_wrap=0.03, damping=damping)
    rest, drive = chain.slip.rest.sum(), 0.0
    for _ in range(30):
        drive += rng.choice([1e-5, 1e-3, 2e-2]) * rng.standard_normal()
        shaken = q.copy()
        shaken[12:] += rng.choice([1e-6, 1e-3]) * rng.standard_normal(q.size - 12)
        before = chain.work
        chain.step(drive, shaken)
        assert chain.work >= before
        assert chain.tension.min() >= 0.0
        assert chain.slip.rest.sum() == pytest.approx(rest, abs=1e-12)


def test_a_hole_that_sticks_lets_nothing_through_to_the_last_bit():
    chain = Chain(arc(10.0), mu=0.2)
    before = chain.slip.rest.copy()
    chain.step(1e-6)  # far less than the first hole holds
    assert np.array_equal(chain.slip.rest, before)
    assert chain.tension[0] > 5.0
    np.testing.assert_allclose(chain.tension[1:], 5.0, rtol=1e-12)
