"""Internal steps that are as long as the bound on their error lets them be."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.robot import dynamics
from tcrctl.robot.equations import make_workspace

RHO = 0.8
LONGEST = 5e-3


class Motion:
    """A robot that starts at rest and whose drives take another speed every 50 ms."""

    def __init__(self, robot, bound=np.inf, h=LONGEST):
        self.robot, self.rule = robot, dynamics.Rule(h, RHO, bound)
        self.state = dynamics.rest_state(robot.rest.q, np.zeros(robot.n_cables))
        self.work, self.scratch = make_workspace(robot.model), dynamics.make_scratch(robot.model)
        self.iterations = 0

    def advance(self, speed, duration):
        done = dynamics.advance(
            self.robot.model,
            self.state,
            speed,
            duration,
            self.rule,
            self.robot.weight,
            self.work,
            self.scratch,
        )
        assert done[0]
        self.iterations += done[3]

    def wander(self, periods=20, cut=(0.05,)):
        """Return the shapes at the ends of the periods (periods, 3 n_nodes) [m]."""
        shapes = []
        for k in range(periods):
            speed = 0.03 * np.cos(0.1 * k + np.arange(self.robot.n_cables))
            for part in cut:
                self.advance(speed, part)
            shapes.append(self.state.q.copy())
        return np.array(shapes)


@pytest.fixture(scope="module")
def fine(tcr5x4):
    """What very small steps give."""
    return Motion(tcr5x4, h=1e-4).wander()


def test_a_smaller_bound_gives_a_smaller_error(tcr5x4, fine):
    """The bound is of one step; errors of a motion add up, and die away with its vibrations."""
    errors = [np.abs(Motion(tcr5x4, bound).wander() - fine).max() for bound in (3e-6, 3e-7, 3e-8)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2], errors
    assert errors[1] < 50.0 * 3e-7


def test_chosen_steps_cost_less_than_fixed_ones_that_are_as_good(tcr5x4, fine):
    chosen = Motion(tcr5x4, bound=1e-7)
    error = np.abs(chosen.wander() - fine).max()
    for h in (5e-3, 2.5e-3, 1.25e-3, 6.25e-4, 3.125e-4):
        fixed = Motion(tcr5x4, h=h)
        if np.abs(fixed.wander() - fine).max() <= error:
            break
    assert chosen.iterations < fixed.iterations


def test_the_error_of_a_step_is_told_within_a_factor_of_two(tcr5x4):
    """In a smooth swing: against a hundred small steps over the same time."""
    start = Motion(tcr5x4, h=2.5e-4)
    start.advance(np.full(4, 0.01), 0.3)
    start.advance(np.zeros(4), 0.7)  # what vibrates along the axis has died away
    told, true = [], []
    for h in (2e-3, 4e-3):
        step, exact = Motion(tcr5x4, h=h), Motion(tcr5x4, h=h / 100.0)
        for motion in (step, exact):
            for mine, given in zip(motion.state[:5], start.state[:5], strict=True):
                mine[:] = given
            motion.advance(np.zeros(4), h)
        told.append(dynamics.error_share(RHO) * np.abs(step.scratch.q - step.scratch.q0).max())
        true.append(np.abs(step.state.q - exact.state.q).max())
    assert np.all(np.array(told) > 0.5 * np.array(true)), (told, true)
    assert np.all(np.array(told) < 2.0 * np.array(true)), (told, true)


def test_time_may_be_cut_anywhere(tcr5x4):
    """The bound holds whatever the cut; where steps end differs, and so does the last part of the error."""
    whole = Motion(tcr5x4, bound=1e-7).wander()
    for cut in ((0.037, 0.013), (0.0499, 0.0001), (0.01,) * 5):
        assert np.abs(Motion(tcr5x4, bound=1e-7).wander(cut=cut) - whole).max() < 2e-6


def test_steps_grow_in_rest_and_shrink_in_a_jolt(tcr5x4):
    motion = Motion(tcr5x4, bound=1e-7)
    motion.advance(np.zeros(4), 0.05)
    at_rest = motion.iterations
    motion.advance(np.array([0.05, -0.05, 0.05, -0.05]), 0.05)
    assert at_rest <= 10  # of 5 ms each
    assert motion.iterations - at_rest > 20
    assert motion.scratch.halvings[0] <= dynamics.PRECISE_HALVINGS
