"""Laws of the kinematic baseline: the pseudo-inverse, arrival, limits; slow modes bound the gain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from support.closed_loop import closed_loop, constant, resting
from tcrctl.controller.controller import build_controller
from tcrctl.controller.kinematic import free_rates, resolved_rates
from tcrctl.controller.settings import KinematicSettings
from tcrctl.plant.settings import Mismatch
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium

ENTRY = st.floats(-1.0, 1.0)


def kinematic(**changes):
    return KinematicSettings(kind="kinematic", **changes)


@pytest.mark.slow
@given(arrays(float, (3, 6), elements=ENTRY), arrays(float, 3, elements=ENTRY), st.floats(0.01, 1.0))
def test_damped_rates_are_the_regularised_least_squares_solution(J, rate, damping):
    J = J + np.eye(3, 6)  # so that no direction counts as free
    singular = np.linalg.svd(J, compute_uv=False)
    if singular[-1] < 0.01 * singular[0]:
        return
    expected = J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(3), rate)
    np.testing.assert_allclose(resolved_rates(J, rate, damping), expected, atol=1e-9)


@given(arrays(float, (5, 6), elements=ENTRY), arrays(float, 6, elements=ENTRY))
def test_free_rates_leave_the_end_where_it_is(J, rate):
    T = np.diag(np.arange(1.0, 7.0))
    speed = free_rates(J, T, rate)
    assert np.max(np.abs(J @ speed)) <= 2.1e-3 * np.linalg.norm(J, 2) * np.linalg.norm(speed) + 1e-12


def test_a_robot_with_as_many_cables_as_outputs_has_no_free_rates():
    assert np.array_equal(free_rates(np.eye(3), np.eye(3), np.ones(3)), np.zeros(3))


def test_the_end_moves_as_resolved(tcr700):
    """One command, held for a while, moves the robot at rest by what the reference asked."""
    settings = kinematic(output="pose", gain_1_s=0.0, damping=0.0, tension="off")
    controller = build_controller(settings, tcr700)
    reference = constant(tcr700, controller)
    step = np.array([2e-4, -1e-4, 3e-4])
    reference.ahead_position[:] += step
    command, info = controller.control(resting(tcr700), reference)
    end = equilibrium(tcr700.model, command.drive, tcr700.weight, tcr700.rest.q)
    moved = pose.position(end.q, tcr700.tip) - tcr700.rest_position
    np.testing.assert_allclose(moved, step, atol=0.03 * np.linalg.norm(step))
    assert np.linalg.norm(pose.normal(end.q, tcr700.tip) - tcr700.rest_normal) < 1e-4
    np.testing.assert_allclose(info.predicted_tension, end.tension, atol=0.02)


def test_tensions_come_back_while_the_end_stays(tcr700):
    uneven = np.array([4e-3, -4e-3, 4e-3, -4e-3, 4e-3, -4e-3])
    start = equilibrium(tcr700.model, uneven, tcr700.weight, tcr700.rest.q)
    controller = build_controller(kinematic(output="pose", gain_1_s=0.0), tcr700)
    reference = constant(tcr700, controller)
    estimate = resting(tcr700, uneven)
    command, _ = controller.control(estimate, reference)
    end = equilibrium(tcr700.model, command.drive, tcr700.weight, start.q)
    assert np.linalg.norm(end.tension - 5.0) < np.linalg.norm(start.tension - 5.0)
    assert np.linalg.norm(pose.position(end.q, tcr700.tip) - pose.position(start.q, tcr700.tip)) < 1e-5


@pytest.mark.slow
def test_it_arrives_on_a_plant_of_other_material(tcr600):
    mismatch = Mismatch(springs_youngs_modulus=0.7, density=1.2)
    errors, speeds, infos = closed_loop(tcr600, kinematic(), (0.01, 0.0, 0.03), 25.0, mismatch)
    assert all(info.converged for info in infos)
    assert errors[0] > 0.02
    assert np.mean(errors[-20:]) < 1e-3
    assert np.abs(speeds).max() <= 0.05


@pytest.mark.slow
def test_too_high_a_gain_shakes_the_slow_modes_up(tcr600):
    """So there is something for the dynamic model to do."""
    errors, _, _ = closed_loop(tcr600, kinematic(gain_1_s=3.0), (0.005, 0.0, 0.02), 8.0)
    assert errors[-20:].max() > 0.02


@pytest.mark.parametrize("limit", [1.0, 20.0])
def test_commands_keep_the_limits_of_speed_and_stroke(tcr600, limit):
    settings = kinematic(gain_1_s=5.0, speed_limit_mm_s=limit)
    controller = build_controller(settings, tcr600)
    command, info = controller.control(resting(tcr600), constant(tcr600, controller, (0.1, 0.05, 0.1)))
    assert np.abs(command.speed).max() == pytest.approx(limit / 1000.0)
    assert info.saturated.any()
    _, high = tcr600.stroke
    ended = resting(tcr600, np.full(3, high - 1e-5))
    command, _ = controller.control(ended, constant(tcr600, controller, (0.0, 0.0, 0.5)))
    assert np.all(command.drive <= high + 1e-12)
