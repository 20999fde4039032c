"""Laws of the elements: forces from potentials, rigid motion, action and reaction, the ring's integrals."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support import mechanics
from support.mechanics import FREE
from tcrctl.elements import bar, sliding_cable, torus
from tcrctl.robot.equations import assemble, make_workspace, residual

ANGLES = st.floats(-2 * math.pi, 2 * math.pi)
SEEDS = st.integers(0, 10**6)
STATIC, DAMPED = 0.0, 300.0


def shape(seed, modules=3, base=True):
    """Rings of radius 35 mm, 50 mm apart, every node moved by some millimetres; ring 0 is the fixed base."""
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi / 3 * np.arange(3)
    ring = np.stack([0.035 * np.cos(angles), 0.035 * np.sin(angles), 0 * angles], axis=1)
    module = np.vstack([ring, [[0.0, 0.0, -0.06]]])
    nodes = np.vstack([module - [0, 0, 0.05 * i] for i in range(modules + 1)])
    nodes += 0.004 * rng.standard_normal(nodes.shape)
    return nodes.ravel(), rng


def one_bar(stretch, tension_only):
    """A damped bar between n1 of module 1 and the apex of module 2, ``stretch`` of its rest length too long."""
    q, rng = shape(3)
    ends = q.reshape(-1, 3)[[4, 11]]
    rest = np.linalg.norm(ends[1] - ends[0]) / (1.0 + stretch)
    return mechanics.elements_only(3, bars=[(4, 11, rest, 2500.0, 0.7, tension_only)]), q, rng


def one_cable(angles, slack=False, first_ring=0):
    """A damped cable from ring to ring through holes at ``angles``."""
    q, rng = shape(5)
    holes = [(first_ring + i, torus.point_weights(angle)) for i, angle in enumerate(angles)]
    points = [np.array(weights) @ q.reshape(-1, 3)[4 * ring : 4 * ring + 3] for ring, weights in holes]
    path = sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(points))
    rest = (path + 0.1) * (1.02 if slack else 0.98)
    return mechanics.elements_only(3, cables=[(holes, rest, 4000.0, 1.3, 0.1)]), q, rng


def evaluate(model, load, q, with_tangent=False):
    """Potential, residual and workspace at q with all drives at zero."""
    ws = make_workspace(model)
    energy = assemble(model, q, np.zeros(len(model.cables)), load, ws, np.bool_(with_tangent))
    return energy, ws.r.copy(), ws


def assert_derivatives_agree(model, load, q):
    """r = d(potential)/dq and tangent = dr/dq, both against central differences."""
    energy, r, ws = evaluate(model, load, q, with_tangent=True)
    tangent = mechanics.dense_tangent(ws)
    gradient = mechanics.free_slopes(lambda x: evaluate(model, load, x)[0], q, 1e-6)
    np.testing.assert_allclose(r, gradient, rtol=0, atol=1e-7 * max(1.0, np.abs(r).max()))
    jacobian = mechanics.free_slopes(lambda x: evaluate(model, load, x)[1], q, 1e-6)
    np.testing.assert_allclose(tangent, jacobian, rtol=0, atol=1e-6 * max(1.0, np.abs(tangent).max()))
    return energy, r, tangent


def internal(model, q, w):
    """Load of elements alone: no inertia, no forces; the lengths before are those of q."""
    before = mechanics.rule_load(model, np.random.default_rng(0), q)
    return before._replace(w=w, nodal=np.zeros_like(before.nodal))


@pytest.mark.slow
@pytest.mark.parametrize("w", [STATIC, DAMPED])
@pytest.mark.parametrize("stretch", [0.05, -0.05])
@pytest.mark.parametrize("tension_only", [0.0, 1.0])
def test_a_bars_force_and_tangent_derive_from_its_potential(tension_only, stretch, w):
    model, q, _ = one_bar(stretch, tension_only)
    energy, r, tangent = assert_derivatives_agree(model, internal(model, q, w), q)
    slack = tension_only == 1.0 and stretch < 0.0
    assert slack == (energy == 0.0) == (not r.any()) == (not tangent.any())


def test_a_bars_tension_is_hookes_law_plus_viscous_drag():
    model, q, _ = one_bar(0.05, 1.0)
    rest, k, c, _ = model.bars[0]
    length, *_ = bar.direction(q, 4, 11)
    assert bar.tension(length, 0.0, 0.0, model.bars, 0) == pytest.approx(k * (length - rest))
    rate = DAMPED * (length - 0.99 * length)
    expected = k * (length - rest) + c * rate
    assert bar.tension(length, DAMPED, 0.99 * length, model.bars, 0) == pytest.approx(expected)


@pytest.mark.slow
@pytest.mark.parametrize("w", [STATIC, DAMPED])
@pytest.mark.parametrize("slack", [False, True])
@given(angles=st.lists(ANGLES, min_size=2, max_size=4))
def test_a_cables_force_and_tangent_derive_from_its_potential_wherever_its_holes_are(slack, w, angles):
    model, q, _ = one_cable(angles, slack)
    load = internal(model, q, w)._replace(cable_before=np.array([model.cables[0, sliding_cable.REST]]))
    energy, r, tangent = assert_derivatives_agree(model, load, q)
    assert slack == (energy == 0.0) == (not r.any()) == (not tangent.any())


@given(angles=st.lists(ANGLES, min_size=3, max_size=4), seed=SEEDS)
def test_the_second_derivative_of_a_path_length_is_positive_semidefinite(angles, seed):
    model, _, _ = one_cable(angles)
    q, _ = shape(seed)
    _, _, ws = evaluate(model, internal(model, q, STATIC), q, with_tangent=True)
    ws.axial[:] = 0.0
    eigenvalues = np.linalg.eigvalsh(mechanics.dense_tangent(ws))
    assert eigenvalues.min() > -1e-12 * max(1.0, eigenvalues.max())


def free_structure(seed):
    """Rods, a spring and two cables on rings 1 to 3, tied to nothing; all of them strained."""
    q, rng = shape(seed)
    pairs = [(4, 7), (5, 7), (6, 7), (7, 8), (7, 9), (11, 12), (8, 14), (4, 13)]
    bars = [(i, j, 0.03, 1000.0, 0.5, float(k % 2)) for k, (i, j) in enumerate(pairs)]
    cables = [
        ([(ring, torus.point_weights(rng.uniform(0, 7))) for ring in (1, 2, 3)], 0.12, 3000.0, 1.0, 0.05),
        ([(ring, torus.point_weights(rng.uniform(0, 7))) for ring in (1, 3)], 0.1, 3000.0, 1.0, 0.05),
    ]
    return mechanics.elements_only(3, bars, cables), q, rng


@given(seed=SEEDS)
def test_internal_forces_have_no_resultant_and_no_moment(seed):
    model, q, _ = free_structure(seed)
    load = mechanics.rule_load(model, np.random.default_rng(seed), q, w=DAMPED)
    load.nodal[:] = 0.0
    _, r, _ = evaluate(model, load, q)
    nodes, forces = q[FREE:].reshape(-1, 3), r.reshape(-1, 3)
    assert np.abs(forces).max() > 1.0
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-11 * np.abs(forces).max())
    moment = np.cross(nodes, forces).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * np.abs(forces).max())


def rotation(rng):
    """Random proper rotation matrix."""
    Q, R = np.linalg.qr(rng.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.linalg.det(Q)


@given(seed=SEEDS)
def test_rigid_motion_stores_no_energy(seed):
    model, q, rng = free_structure(seed)
    load = internal(model, q, STATIC)
    energy, r, _ = evaluate(model, load, q)
    R = rotation(rng)
    moved = (q.reshape(-1, 3) @ R.T + rng.standard_normal(3)).ravel()
    energy_moved, r_moved, _ = evaluate(model, load, moved)
    assert energy > 0.1
    assert energy_moved == pytest.approx(energy, rel=1e-12)
    turned = (r.reshape(-1, 3) @ R.T).ravel()
    np.testing.assert_allclose(r_moved, turned, atol=1e-11 * np.abs(r).max())


@given(seed=SEEDS)
def test_elongation_rates_are_the_time_derivatives_of_lengths(seed):
    model, q, rng = free_structure(seed)
    v = rng.standard_normal(q.size)
    length, rate, ahead, behind, unused = (np.zeros(len(model.bars)) for _ in range(5))
    bar.lengths_and_rates(q, v, model.bar_nodes, length, rate)
    bar.lengths_and_rates(q + 1e-7 * v, v, model.bar_nodes, ahead, unused)
    bar.lengths_and_rates(q - 1e-7 * v, v, model.bar_nodes, behind, unused)
    np.testing.assert_allclose(rate, (ahead - behind) / 2e-7, atol=1e-6)


def test_a_cable_pulls_the_same_everywhere_along_its_path():
    model, q, _ = one_cable([0.3, 2.0, 4.0], first_ring=1)
    ws = make_workspace(model)
    residual(model, q, np.array([0.005]), internal(model, q, STATIC), ws)
    rest, k, _, lead = model.cables[0]
    points = [
        model.hole_weights[hole] @ q.reshape(-1, 3)[model.hole_nodes[hole]]
        for hole in range(len(model.hole_nodes))
    ]
    path = lead + sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(points))
    assert ws.length[0] == pytest.approx(path, rel=1e-14)
    assert ws.tension[0] == pytest.approx(k * (path + 0.005 - rest), rel=1e-12)
    end = ws.r.reshape(-1, 3)[8:11].sum(axis=0)  # ring 3 feels the cable's last segment alone
    np.testing.assert_allclose(np.linalg.norm(end), ws.tension[0], rtol=1e-12)


@given(angle=ANGLES, seed=SEEDS)
def test_a_hole_is_a_point_of_the_ring_at_its_angle_wherever_the_ring_moves(angle, seed):
    rng = np.random.default_rng(seed)
    R, centre, radius = rotation(rng), rng.standard_normal(3), 0.035
    corners = 2 * np.pi / 3 * np.arange(3)

    def point(angles):
        return centre + radius * (np.outer(np.cos(angles), R[0]) + np.outer(np.sin(angles), R[1]))

    weights = torus.point_weights(angle)
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(weights @ point(corners), point(np.array([angle]))[0], atol=1e-14)


def test_holes_at_the_nodes_belong_to_them_alone():
    corners = np.array([torus.point_weights(k * torus.TURN_THIRD) for k in range(3)])
    assert np.array_equal(corners != 0.0, np.eye(3, dtype=bool))
    np.testing.assert_allclose(corners, np.eye(3), atol=1e-15)


@given(seed=SEEDS)
def test_kinetic_energy_of_a_ring_is_the_integral_over_its_circumference(seed):
    mass, v = 0.005, np.random.default_rng(seed).standard_normal((3, 3))
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    along = np.array([torus.point_weights(angle) @ v for angle in angles])
    integral = 0.5 * mass * np.mean(np.sum(along**2, axis=1))
    lumped = 0.5 * torus.node_mass(mass) * np.sum(v**2)
    assert 3 * torus.node_mass(mass) == pytest.approx(mass)
    assert lumped == pytest.approx(integral, rel=1e-12)


def test_a_spinning_ring_has_the_moment_of_inertia_of_a_hoop():
    mass, radius, spin = 0.005, 0.035, 11.0
    v = spin * radius * np.array([[-math.sin(a), math.cos(a)] for a in 2 * np.pi / 3 * np.arange(3)])
    assert 0.5 * torus.node_mass(mass) * np.sum(v**2) == pytest.approx(0.5 * mass * radius**2 * spin**2)
