"""Laws of the drag of dithered holes: its paths are derivatives, it only takes energy, none without a dither."""

from __future__ import annotations

import numpy as np
import pytest

from support.mechanics import FREE
from tcrctl.elements import sliding_cable
from tcrctl.elements.sliding_cable import LEAD
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import equilibrium, static_load
from tcrctl.robot.hole_drag import SMALL, drag_force, fill_hole_drag, no_drag, project_drag, turn
from tcrctl.robot.potential import minimise
from tcrctl.robot.robot import hole_friction
from tcrctl.robot.sections import FrictionSettings

FRICTION = FrictionSettings(coefficient=0.1, least_wrap_deg=2.0)


@pytest.fixture(params=["tcr600", "tcr700"])
def bent(request):
    """A robot at a bent equilibrium: its arrays, node positions, workspace there, and drag of a dither."""
    robot = request.getfixturevalue(request.param)
    model = robot.model
    drive = 0.012 + 0.006 * np.cos(np.arange(robot.n_cables))
    q = equilibrium(model, drive, robot.weight, robot.rest.q).q.copy()
    ws = make_workspace(model)
    assert minimise(model, q, drive, static_load(model, robot.weight), ws, 1e-8, 60, True).converged
    drag = no_drag(model)
    fill_hole_drag(model, q, ws, hole_friction(FRICTION, model.first_hole), turn(0.1, 2e-3), drag)
    return model, q, ws, drag


def paths(model, q):
    """Path from the actuator to every hole, and length of the whole cable, per hole (n_holes, 2) [m]."""
    found = np.zeros((model.hole_nodes.shape[0], 2))
    for c in range(model.cables.shape[0]):
        x = model.cables[c, LEAD]
        for hole in range(model.first_hole[c], model.first_hole[c + 1]):
            found[hole, 0] = x
            if hole < model.first_hole[c + 1] - 1:
                x += sliding_cable.segment(q, model.hole_nodes, model.hole_weights, hole)[0]
        found[model.first_hole[c] : model.first_hole[c + 1], 1] = x
    return found


def rates(model, drag, v, speed):
    """Mean rates at which material slips through the holes (n_holes,) [m/s]."""
    cable = np.repeat(np.arange(model.cables.shape[0]), np.diff(model.first_hole))
    return drag.path @ v[FREE:] + drag.through * speed[cable]


def test_paths_are_derivatives_of_where_material_slips(bent):
    model, q, _, drag = bent
    v = np.zeros_like(q)
    v[FREE:] = np.random.default_rng(2).standard_normal(v[FREE:].shape)
    step = 1e-6
    ahead, behind, now = paths(model, q + step * v), paths(model, q - step * v), paths(model, q)
    rate = (ahead - behind) / (2 * step)
    expected = rate[:, 0] - now[:, 0] / now[:, 1] * rate[:, 1]
    expected[model.first_hole[1:] - 1] = 0.0  # nothing slips through an anchor
    np.testing.assert_allclose(drag.path @ v[FREE:], expected, atol=1e-6)


def test_drag_takes_energy_out_of_every_motion(bent):
    model, q, _, drag = bent
    rng = np.random.default_rng(3)
    for _ in range(20):
        v = np.zeros_like(q)
        v[FREE:] = rng.standard_normal(v[FREE:].shape)
        still = np.zeros(model.cables.shape[0])
        force = np.zeros(v[FREE:].size)
        drag_force(model, drag, v, still, force)
        lost = np.sum(drag.coefficient * rates(model, drag, v, still) ** 2)
        assert force @ v[FREE:] == pytest.approx(-lost, rel=1e-9)
        assert lost > 0.0


def test_the_force_is_the_derivative_of_the_dissipation(bent):
    model, q, _, drag = bent
    rng = np.random.default_rng(5)
    v, other = np.zeros_like(q), np.zeros_like(q)
    v[FREE:], other[FREE:] = rng.standard_normal((2, v[FREE:].size))
    speed = rng.standard_normal(model.cables.shape[0])
    force = np.zeros(v[FREE:].size)
    drag_force(model, drag, v, speed, force)

    def dissipation(s):
        return 0.5 * np.sum(drag.coefficient * rates(model, drag, v + s * other, speed) ** 2)

    assert force @ other[FREE:] == pytest.approx(-(dissipation(1.0) - dissipation(-1.0)) / 2.0, rel=1e-9)


def test_the_reduced_drag_is_that_of_all_nodes(bent):
    model, q, _, drag = bent
    m = model.cables.shape[0]
    rng = np.random.default_rng(6)
    V = rng.standard_normal((drag.path.shape[1], 5))
    D, F = np.zeros((5, 5)), np.zeros((5, m + 1))
    project_drag(model, drag, V, D, F)
    for r in range(5):
        v, force = np.zeros_like(q), np.zeros(V.shape[0])
        v[FREE:] = V[:, r]
        drag_force(model, drag, v, np.zeros(m), force)
        np.testing.assert_allclose(D[:, r], -V.T @ force, rtol=1e-9, atol=1e-12)
    for c in range(m):
        force = np.zeros(V.shape[0])
        drag_force(model, drag, np.zeros_like(q), np.eye(m)[c], force)
        np.testing.assert_allclose(F[:, c], V.T @ force, rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(D).min() > -1e-9
    assert not F[:, m].any()


def test_drag_grows_with_friction_and_tension_and_falls_with_the_dither(bent):
    model, q, ws, drag = bent
    wide, slippery, tight = no_drag(model), no_drag(model), no_drag(model)
    usual = hole_friction(FRICTION, model.first_hole)
    fill_hole_drag(model, q, ws, usual, turn(0.1, 4e-3), wide)
    np.testing.assert_allclose(wide.coefficient, 0.5 * drag.coefficient)
    none = hole_friction(FrictionSettings(coefficient=0.0), model.first_hole)
    fill_hole_drag(model, q, ws, none, turn(0.1, 2e-3), slippery)
    assert not slippery.coefficient.any()
    ws.tension[:] *= 2.0
    fill_hole_drag(model, q, ws, usual, turn(0.1, 2e-3), tight)
    np.testing.assert_allclose(tight.coefficient, 2.0 * drag.coefficient)


def test_a_dither_that_keeps_no_cable_sliding_gives_no_drag(bent):
    model, q, ws, drag = bent
    assert turn(0.1, 0.99 * SMALL) == 0.0
    fill_hole_drag(model, q, ws, hole_friction(FRICTION, model.first_hole), 0.0, drag)
    assert not drag.coefficient.any()
