"""Laws of the reach of a dither: a wave that arrives counts 1, one that is used up less, all else nothing."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller.wave_reach import WaveReach
from tcrctl.robot.module import FIXED, NODES
from tcrctl.robot.swing import signs

HALF = 10  # periods of half a wave
PHASE = np.pi * np.arange(8 * HALF) / HALF
#: A wave of the drives' lengths [m].
WAVE = 1e-3 * np.sin(PHASE)


def told(robot, sent, came, extra=lambda q, k: q):
    """The reach, after the drives have moved by ``sent`` (n,) and the robot as they would move it by ``came``."""
    toward = signs(robot)
    reach = WaveReach(robot, toward, HALF)
    moved = np.zeros_like(robot.rest.q)
    moved[moved.size - robot.rest.gain.shape[0] :] = robot.rest.gain @ toward
    for k, (drive, robots) in enumerate(zip(sent, came, strict=True)):
        reach.observe(extra(robot.rest.q + robots * moved, k), drive * toward)
    return reach


@pytest.fixture(params=["tcr600", "tcr700"])
def robot(request):
    return request.getfixturevalue(request.param)


def test_all_of_the_wave_arrives_in_a_robot_that_moves_as_the_model(robot):
    reach = told(robot, WAVE, WAVE)
    assert reach.share == pytest.approx(1.0, abs=1e-3)
    assert reach.tells


@pytest.mark.parametrize("part", [0.0, 0.3, 0.7])
def test_a_part_of_the_wave_counts_as_that_part(robot, part):
    assert told(robot, WAVE, part * WAVE).share == pytest.approx(part, abs=1e-3)


def test_a_wave_that_comes_a_quarter_late_does_not_count(robot):
    assert told(robot, WAVE, -1e-3 * np.cos(PHASE)).share == pytest.approx(0.0, abs=0.1)


def test_modules_that_hang_still_are_missed(tcr600):
    """The wave is used up in the upper half of the robot."""
    half = (FIXED + NODES * (tcr600.n_modules // 2)) * 3

    def lower_half_follows(q, k):
        q = q.copy()
        shift = (q[half - 12 : half] - tcr600.rest.q[half - 12 : half]).reshape(-1, 3)[:3].mean(axis=0)
        q[half:] = tcr600.rest.q[half:] + np.tile(shift, (q.size - half) // 3)
        return q

    assert told(tcr600, WAVE, WAVE, lower_half_follows).share == pytest.approx(0.5, abs=0.1)


def test_markers_beside_their_nodes_and_a_steady_motion_change_nothing(robot):
    random = np.random.default_rng(1)
    bias, drift = 1e-3 * random.standard_normal((2, robot.rest.q.size))
    share = told(robot, WAVE, 0.5 * WAVE, lambda q, k: q + bias + 0.01 * k * drift).share
    assert share == pytest.approx(0.5, abs=0.05)


def test_of_cables_of_one_length_against_each_other_nothing_is_seen(tcr5x4):
    reach = told(tcr5x4, WAVE, WAVE)
    assert not reach.sees
    assert not reach.tells
    assert reach.share == 1.0


def test_a_faint_wave_tells_nothing(robot):
    reach = told(robot, 0.01 * WAVE, np.zeros(WAVE.size))
    assert reach.share == 1.0
    assert not reach.tells
