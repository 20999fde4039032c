"""The assembled robot: forces from one potential, tangents from forces, structured solves against dense ones."""

from __future__ import annotations

import numpy as np
import pytest

from support import mechanics
from support.mechanics import FREE
from tcrctl.elements import sliding_cable
from tcrctl.robot import linear
from tcrctl.robot.equations import assemble, make_workspace, residual
from tcrctl.robot.module import FIXED, ring_rows

ROBOTS = ["tcr600", "tcr700", "tcr5x4"]
RULES = {
    "statics": {},
    "backward Euler": {"inertia": 1 / 0.05**2, "w": 1 / 0.05},
    "generalized-alpha": {"inertia": 3e6, "w": 2000.0},
    "observer": {"inertia": 400.0, "w": 20.0, "springs": 200.0},
}
YES = np.bool_(True)
SKIPPING = {
    "spring": ("springs.between=[{nodes: [m1.apex, m3.n1], natural_length_mm: 54}]",),
    "long spring": ("springs.between=[{nodes: [m1.n2, m4.apex], natural_length_mm: 200}]",),
    "cable": (
        "cables.routes.3={name: d, initial_tension_n: 0.2, through: "
        "[{ring: 0, hole_deg: 270}, {ring: 2, hole_deg: 250}, {ring: 5, hole_deg: 270}]}",
        "cables.routes.1={name: b, hole_deg: 120, to_ring: 5}",
        "cables.routes.2={name: c, hole_deg: 240, to_ring: 5}",
    ),
}


@pytest.fixture(params=ROBOTS)
def robot(request):
    return request.getfixturevalue(request.param)


def situation(robot, rule, seed=0):
    """A load of the rule, a deformed shape and drives with one slack cable."""
    q = mechanics.deformed(robot, seed)
    load = mechanics.rule_load(robot.model, np.random.default_rng(seed), q, **RULES[rule])
    return load, q, mechanics.some_drives(robot, seed)


def linearised(robot, rule, seed=0):
    """Workspace with K, G, r and a factor of K (shifted if need be), and the dense tangent that goes with it."""
    load, q, drive = situation(robot, rule, seed)
    ws = make_workspace(robot.model)
    assemble(robot.model, q, drive, load, ws, YES)
    shift = linear.factor_shifted(ws.K, ws.U)
    return ws, mechanics.dense_tangent(ws) + shift * np.eye(ws.r.size)


@pytest.mark.parametrize("rule", RULES)
def test_the_residual_is_the_gradient_of_the_incremental_potential(robot, rule):
    load, q, drive = situation(robot, rule)
    ws = make_workspace(robot.model)
    gradient = mechanics.free_slopes(lambda x: residual(robot.model, x, drive, load, ws), q, 3e-7)
    residual(robot.model, q, drive, load, ws)
    np.testing.assert_allclose(ws.r, gradient, rtol=0, atol=3e-7 * np.abs(ws.r).max())


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_tangent_is_the_derivative_of_the_residual(robot, rule, seed):
    load, q, drive = situation(robot, rule, seed)
    ws = make_workspace(robot.model)

    def force(x):
        residual(robot.model, x, drive, load, ws)
        return ws.r.copy()

    jacobian = mechanics.free_slopes(force, q, 1e-8)
    assemble(robot.model, q, drive, load, ws, YES)
    taut = ws.tension > 0.0
    assert taut.any()
    assert not taut.all()
    tangent = mechanics.dense_tangent(ws)
    np.testing.assert_allclose(tangent, jacobian, rtol=0, atol=1e-6 * np.abs(tangent).max())
    np.testing.assert_allclose(jacobian, jacobian.T, rtol=0, atol=2e-6 * np.abs(tangent).max())


def test_tensions_and_gradients_follow_the_drives_and_the_shape(robot):
    load, q, drive = situation(robot, "statics")
    ws = make_workspace(robot.model)

    def lengths(x):
        residual(robot.model, x, drive, load, ws)
        return ws.length.copy()

    slope = mechanics.slopes(lengths, q, 1e-7)
    residual(robot.model, q, drive, load, ws)
    np.testing.assert_allclose(ws.G, slope, atol=1e-8)
    rest, stiffness = (
        robot.model.cables[:, sliding_cable.REST],
        robot.model.cables[:, sliding_cable.STIFFNESS],
    )
    expected = np.maximum(0.0, stiffness * (ws.length + drive - rest))
    np.testing.assert_allclose(ws.tension, expected, atol=1e-12)
    assert np.array_equal(ws.axial, np.where(expected > 0.0, stiffness, 0.0))


def test_without_the_tangent_the_residual_is_the_same_and_k_is_untouched(robot):
    load, q, drive = situation(robot, "backward Euler")
    full, bare = make_workspace(robot.model), make_workspace(robot.model)
    bare.K[:] = np.nan
    energies = [
        assemble(robot.model, q, drive, load, full, YES),
        assemble(robot.model, q, drive, load, bare, np.bool_(False)),
    ]
    assert energies[0] == energies[1]
    assert np.array_equal(full.r, bare.r)
    assert np.isnan(bare.K).all()


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["statics", "generalized-alpha"])
@pytest.mark.parametrize("seed", [0, 3])
def test_structured_solves_equal_dense_ones(robot, rule, seed):
    ws, A = linearised(robot, rule, seed)
    rng = np.random.default_rng(seed)
    b, x = rng.standard_normal(ws.r.size), np.empty(ws.r.size)
    linear.solve(ws, b, x)
    scale = np.linalg.cond(A) * 1e-14
    expected = np.linalg.solve(A, b)
    again = b.copy()
    linear.solve_again(ws, again)
    for found in (x, again):
        np.testing.assert_allclose(found, expected, rtol=0, atol=scale * np.abs(expected).max())
    many = rng.standard_normal((ws.r.size, 4))
    expected = np.linalg.solve(A, many)
    linear.solve_many(ws, many)
    np.testing.assert_allclose(many, expected, rtol=0, atol=scale * np.abs(expected).max())


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["statics", "generalized-alpha"])
def test_gains_of_the_drives_equal_dense_ones(robot, rule):
    ws, A = linearised(robot, rule)
    linear.couple(ws, ws.r)
    gain = np.empty((ws.r.size, robot.n_cables))
    linear.drive_gain(ws, gain)
    G, C = ws.G[:, FREE:], np.diag(ws.axial)
    expected = -np.linalg.solve(A, G.T @ C)
    np.testing.assert_allclose(gain, expected, rtol=0, atol=np.linalg.cond(A) * 1e-14)
    tensions = C @ (np.eye(robot.n_cables) + G @ expected)
    np.testing.assert_allclose(linear.tension_gain(ws, gain), tensions, atol=1e-7 * ws.axial.max())


def test_a_slack_cable_has_no_gain(robot):
    ws, _ = linearised(robot, "statics")
    linear.couple(ws, ws.r)
    gain = np.empty((ws.r.size, robot.n_cables))
    linear.drive_gain(ws, gain)
    slack = ws.tension == 0.0
    assert slack.any()
    assert not gain[:, slack].any()
    assert gain[:, ~slack].any(axis=0).all()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_eliminating_the_actuation_nodes_gives_the_newton_step_of_the_bordered_system(robot, seed):
    """(26) with unknowns (q, s, λ): s the coordinates of the massless actuation nodes, Φ = s - d = 0."""
    load, q, drive = situation(robot, "generalized-alpha", seed)
    ws, size, m = make_workspace(robot.model), 12 * robot.n_modules, robot.n_cables
    s, multiplier = drive + 1e-4 * np.random.default_rng(seed).standard_normal(m), np.ones(m)
    assemble(
        robot.model, q, s, load, ws, YES
    )  # the cables are strained by where the nodes are, not where they go
    G, C, zero, one = ws.G[:, FREE:], np.diag(ws.axial), np.zeros((size, m)), np.eye(m)
    bordered = np.block(
        [
            [mechanics.dense_tangent(ws), G.T @ C, zero],
            [C @ G, C, -one],
            [zero.T, one, np.zeros((m, m))],
        ]
    )
    unbalanced = np.concatenate([ws.r, ws.tension - multiplier, s - drive])
    step = np.linalg.solve(bordered, -unbalanced)

    assert linear.factor_shifted(ws.K, ws.U) == 0.0
    eliminated, to_drive = np.empty(size), drive - s
    linear.solve(ws, -(ws.r + G.T @ C @ to_drive), eliminated)
    np.testing.assert_allclose(step[size : size + m], to_drive, atol=1e-15)
    np.testing.assert_allclose(eliminated, step[:size], rtol=0, atol=1e-9 * np.abs(step[:size]).max())
    tension = ws.tension + C @ (G @ eliminated + to_drive)
    np.testing.assert_allclose(multiplier + step[size + m :], tension, atol=1e-8 * np.abs(tension).max())


def test_shipped_robots_couple_neighbouring_modules_only(robot):
    assert robot.model.bandwidth == 1


@pytest.mark.parametrize(("what", "width"), [("spring", 2), ("long spring", 3), ("cable", 3)])
def test_springs_and_cables_that_skip_modules_widen_the_band_and_are_solved_right(what, width):
    robot = mechanics.altered("tcr5x4", *SKIPPING[what])
    assert robot.model.bandwidth == width
    load, q, drive = situation(robot, "backward Euler")
    ws = make_workspace(robot.model)

    def force(x):
        residual(robot.model, x, drive, load, ws)
        return ws.r.copy()

    jacobian = mechanics.free_slopes(force, q, 1e-8)
    assemble(robot.model, q, drive, load, ws, YES)
    A, coupling = mechanics.dense_tangent(ws), ws.G[:, FREE:].T @ np.diag(ws.axial) @ ws.G[:, FREE:]
    np.testing.assert_allclose(A, jacobian, rtol=0, atol=1e-6 * np.abs(A).max())
    module = np.arange(60) // 12
    assert (A - coupling)[np.abs(np.subtract.outer(module, module)) == width].any()
    ws, A = linearised(robot, "backward Euler")
    x = np.empty(ws.r.size)
    linear.solve(ws, ws.r, x)
    expected = np.linalg.solve(A, ws.r)
    np.testing.assert_allclose(x, expected, rtol=0, atol=np.linalg.cond(A) * 1e-14 * np.abs(expected).max())


def test_an_indefinite_tangent_is_shifted_until_it_is_positive_and_nan_is_refused(tcr600):
    ws = make_workspace(tcr600.model)
    load, q, drive = situation(tcr600, "statics")
    assemble(tcr600.model, q, drive + 0.05, load, ws, YES)
    ws.K[0, 0, 5, 5] -= 1e6
    shift = linear.factor_shifted(ws.K, ws.U)
    assert shift > 0.0
    eye = np.eye(ws.r.size)
    ws.axial[:] = 0.0
    assert np.linalg.eigvalsh(mechanics.dense_tangent(ws) + shift * eye).min() > 0.0
    assert np.linalg.eigvalsh(mechanics.dense_tangent(ws) + shift / linear.SHIFT_GROWTH * eye).min() < 0.0
    ws.K[3, 0, 0, 0] = np.nan
    assert linear.factor_shifted(ws.K, ws.U) == -1.0


def test_the_weight_is_carried_by_all_nodes_and_the_rows_of_the_rings_are_named(tcr700):
    weight = tcr700.weight.reshape(-1, 3)
    modules, springs_on_base = 13, 3 * 0.4e-3  # the base bears half of the first joint's springs
    expected = 9.81 * (modules * 10e-3 + 3 * modules * 0.8e-3 - springs_on_base)
    assert weight[:, 2].sum() == pytest.approx(-expected, rel=1e-12)
    assert not weight[:FIXED].any()
    assert not weight[:, :2].any()
    assert ring_rows(2) == [4, 5, 6, 8, 9, 10]
