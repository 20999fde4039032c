"""Modes about an equilibrium: known frequencies, orthonormality, and the motion that follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from support import mechanics
from support.mechanics import FREE
from tcrctl.robot import dynamics, pose
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.modes import mass_matrix, modes


def at_rest(robot, count):
    return modes(robot.model, robot.rest, np.zeros(robot.n_cables), robot.weight, count)


def test_the_slowest_modes_of_the_two_segment_robot(tcr700):
    np.testing.assert_allclose(at_rest(tcr700, 4).frequency, [0.92, 0.92, 2.16, 2.16], atol=0.01)


def test_the_slowest_modes_of_the_single_segment_robot(tcr600):
    np.testing.assert_allclose(at_rest(tcr600, 2).frequency, [0.84, 0.84], atol=0.01)


@pytest.mark.parametrize("name", ["tcr600", "tcr700", "tcr5x4"])
def test_shapes_are_orthonormal_in_the_mass_and_diagonalise_the_stiffness(name, request):
    robot = request.getfixturevalue(name)
    found, M = at_rest(robot, 8), mass_matrix(robot.model)
    np.testing.assert_allclose(found.shape.T @ M @ found.shape, np.eye(8), atol=1e-10)
    assert np.all(np.diff(found.frequency) >= -1e-6)
    v = np.concatenate([np.zeros(FREE), np.arange(M.shape[0], dtype=float)])
    np.testing.assert_allclose(M @ v[FREE:], mechanics.mass_times(robot.model, v), rtol=1e-13)


@pytest.mark.parametrize("name", ["tcr600", "tcr700"])
def test_modes_of_a_robot_with_threefold_symmetry_bend_in_pairs(name, request):
    frequency = at_rest(request.getfixturevalue(name), 2).frequency
    assert frequency[0] == pytest.approx(frequency[1], rel=1e-5)


def crossings(signal, step):
    """Frequency [Hz] from the mean time between zero crossings."""
    signal = np.asarray(signal)
    at = np.flatnonzero(np.diff(np.signbit(signal)))
    times = at + signal[at] / (signal[at] - signal[at + 1])
    return 0.5 / (np.diff(times).mean() * step)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tcr600", "tcr700"])
@pytest.mark.parametrize("number", [0, 2])
def test_a_robot_pushed_along_a_mode_swings_at_its_frequency(name, number, request):
    robot = request.getfixturevalue(name)
    model, still = mechanics.undamped(robot.model), np.zeros(robot.n_cables)
    drive = np.full(robot.n_cables, 0.01)
    bent = equilibrium(model, drive, robot.weight, robot.rest.q)
    found = modes(model, bent, drive, robot.weight, 4)
    shape, state = found.shape[:, number], dynamics.rest_state(bent.q, drive)
    state.v[FREE:] = 0.02 * shape / np.abs(shape).max()
    work, scratch, history = make_workspace(model), dynamics.make_scratch(model), []
    rule = dynamics.Rule(h=0.005, rho=1.0)
    for _ in range(round(4.0 / found.frequency[number] / 0.02)):
        assert dynamics.advance(model, state, still, 0.02, rule, robot.weight, work, scratch)[0]
        history.append(shape @ mechanics.mass_times(model, state.q - bent.q))
    assert crossings(history, 0.02) == pytest.approx(found.frequency[number], rel=0.02)
    assert pose.position(state.q, robot.tip) != pytest.approx(pose.position(bent.q, robot.tip), abs=1e-6)
