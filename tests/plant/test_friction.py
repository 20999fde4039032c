"""Friction of the cables in a moving robot: laws that hold whatever the robot does."""

from __future__ import annotations

import numpy as np
import pytest

from support import mechanics
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.equations import FORCE, Q_FREE, Load, assemble, make_workspace
from tcrctl.robot.robot import hole_friction
from tcrctl.robot.sections import FrictionSettings
from tcrctl.robot.unworn import unworn
from tcrctl.signals import Command

PERIOD = 0.05
BEND = np.array([1.0, 0.0, -1.0, 0.0])


def build(robot, mu, step_ms=2.5, **settings):
    friction = None if mu is None else {"coefficient": mu}
    return SimulatedPlant(
        SimulatedSettings(kind="simulated", step_ms=step_ms, friction=friction, **settings), robot, PERIOD, 1
    )


def write(plant, speed):
    plant.write(Command(np.asarray(speed, dtype=float), np.zeros(plant.robot.n_cables)))


def still(plant, seconds):
    for _ in range(round(seconds / PERIOD)):
        write(plant, np.zeros(plant.robot.n_cables))


def settled(robot, mu, step_ms=2.5):
    """A plant that has been bent and stands."""
    plant = build(robot, mu, step_ms)
    for _ in range(10):
        write(plant, 0.04 * BEND)
    still(plant, 6.0)
    return plant


def test_without_a_coefficient_the_plant_is_that_without_friction():
    """Other equations of the same robot; with cables that do not damp they agree to rounding."""
    robot = mechanics.altered("tcr5x4", "cables.damping_n_s_m=0")
    plain, rubbing = build(robot, None), build(robot, 0.0)
    for k in range(30):
        for plant in (plain, rubbing):
            write(plant, 0.04 * np.cos(0.3 * k + np.arange(4)))
        np.testing.assert_allclose(rubbing.truth().q, plain.truth().q, rtol=0, atol=1e-10)
        np.testing.assert_allclose(rubbing.truth().tension, plain.truth().tension, rtol=0, atol=1e-6)
    assert np.abs(plain.truth().q - robot.rest.q).max() > 5e-3


def test_the_damper_of_stretches_in_series_is_that_of_the_cable(tcr5x4):
    """Its rule is of first order, that of a cable without friction of second."""
    errors = []
    for step_ms in (5.0, 2.5, 1.25):
        plain, rubbing, worst = build(tcr5x4, None, step_ms), build(tcr5x4, 0.0, step_ms), 0.0
        for k in range(10):
            for plant in (plain, rubbing):
                write(plant, 0.04 * np.cos(0.3 * k + np.arange(4)))
            worst = max(worst, np.abs(rubbing.truth().q - plain.truth().q).max())
        errors.append(worst)
    assert errors[2] < errors[0] < 3e-4


@pytest.mark.slow
def test_a_robot_that_sticks_stays_for_a_minute(tcr5x4):
    plant = settled(tcr5x4, 0.3)
    slip = plant._body.state.slip
    material, shape = slip.rest.copy(), plant.truth().q
    still(plant, 60.0)
    assert np.array_equal(slip.rest, material)
    assert np.abs(plant.truth().q - shape).max() < 1e-7


@pytest.mark.slow
def test_pushed_and_let_go_a_robot_with_friction_stays_beside_its_equilibrium(tcr5x4):
    push = {"ring": 5, "force_n": (0.3, 0.0, 0.0), "start_s": 0.0, "duration_s": 2.0}
    beside = {}
    for mu, seconds in ((None, 40.0), (0.1, 12.0), (0.3, 12.0)):
        plant = build(tcr5x4, mu, pushes=(push,))
        still(plant, seconds)
        _, v = plant.state()
        beside[mu] = np.linalg.norm(plant.truth().position - tcr5x4.rest_position)
        assert np.abs(v).max() < (1e-3 if mu is None else 1e-4)
    assert beside[None] < 1e-4
    assert beside[0.1] > 1e-3
    assert beside[0.3] > 1e-3


def rubbing_load(robot, q, drive, mu):
    """A time step of a robot that rubs, about to begin at ``q``, and its workspace."""
    model = robot.model
    holes = hole_friction(FrictionSettings(coefficient=mu), model.first_hole)
    slip = unworn(model, q, drive, robot.rest.tension, holes)
    slip.rate[0] = 500.0
    slip.cap[:] = 0.05
    slip.before[:] = slip.tension / slip.stiffness
    nodal = np.zeros((4, q.size))
    nodal[Q_FREE], nodal[FORCE] = q, robot.weight
    ends = q.reshape(-1, 3)[model.bar_nodes]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    load = Load(1e6, 500.0, nodal, lengths, np.zeros(robot.n_cables), slip)
    return load, make_workspace(model, rubbing=True)


@pytest.mark.parametrize("seed", range(3))
def test_forces_and_tangent_derive_from_the_potential_where_some_holes_stick_and_some_slide(tcr5x4, seed):
    q = mechanics.deformed(tcr5x4, seed, bend=0.05)
    load, ws = rubbing_load(tcr5x4, q, np.zeros(4), 0.1)
    drive = 1e-4 * np.random.default_rng(seed).standard_normal(4)

    def evaluated(x):
        energy = assemble(tcr5x4.model, x, drive, load, ws, np.bool_(True))
        return energy, ws.r.copy()

    gradient = mechanics.free_slopes(lambda x: evaluated(x)[0], q, 1e-7)
    jacobian = mechanics.free_slopes(lambda x: evaluated(x)[1], q, 1e-9)
    _, r = evaluated(q)
    np.testing.assert_allclose(r, gradient, rtol=0, atol=1e-5 * max(1.0, np.abs(r).max()))
    rows = ws.stretches.groups[0]
    G = ws.G[:rows, mechanics.FREE :]
    dense = mechanics.block_banded.to_dense(ws.K) + G.T @ (ws.axial[:rows, None] * G)
    np.testing.assert_allclose(dense, jacobian, rtol=0, atol=1e-4 * np.abs(dense).max())
    sticking = ws.stretches.tension == ws.stretches.alone
    assert 0 < sticking.sum() < sticking.size


def loop(robot, mu, step_ms, amplitude=0.015):
    """Area of the loop of a cable's tension over its drive in the second of two slow cycles [J]."""
    plant, area = build(robot, mu, step_ms), 0.0
    for _cycle in range(2):
        area = 0.0
        for side in (1.0, -1.0, -1.0, 1.0):
            for _ in range(20):
                before = plant.truth().tension
                write(plant, side * amplitude / (20 * PERIOD) * BEND)
                mean = 0.5 * (before + plant.truth().tension)
                area += float(side * amplitude / 20 * (mean @ BEND))
    return area


@pytest.mark.slow
def test_the_loop_has_an_area_that_does_not_depend_on_the_step(tcr5x4):
    coarse, middle, fine = (loop(tcr5x4, 0.1, step) for step in (5.0, 2.5, 1.25))
    assert fine > 1e-4
    assert middle == pytest.approx(fine, rel=0.03)
    assert abs(middle - fine) <= abs(coarse - fine) + 0.005 * fine
    assert fine > 3.0 * loop(tcr5x4, 0.0, 2.5)


@pytest.mark.slow
def test_the_motion_converges_with_the_step(tcr5x4):
    """Of first order, on a way on which holes stick, slide and turn."""
    ends = {}
    for step_ms in (5.0, 2.5, 1.25, 0.3125):
        plant, way = build(tcr5x4, 0.1, step_ms), []
        for k in range(20):
            write(plant, 0.05 * np.cos(0.4 * k + np.arange(4)))
            way.append(plant.truth().q)
        ends[step_ms] = np.array(way)
    finest = ends.pop(0.3125)
    errors = [np.sqrt(np.mean((way - finest) ** 2)) for way in ends.values()]
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]
    assert errors[2] < 1e-4
    assert np.abs(finest - tcr5x4.rest.q).max() > 0.03
