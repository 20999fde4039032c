"""Laws of the learnt gain: found where motion tells it, nothing where nothing is told, bounded, forgotten."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller.prediction_settings import RestGainSettings
from tcrctl.controller.rest_gain import carry, gain_learning, no_gain, rest, tell
from tcrctl.robot.module import FIXED

PERIOD, BLEND = 0.05, 0.15
#: One ring above the base is all of this robot, and its end.
FREE, TIP, M = 9, FIXED, 3
T = PERIOD * np.arange(1200)
TRUE = np.outer(np.linspace(0.5, 1.0, FREE), [1.0, -0.5, 0.3])


class Filter:
    """A filter that is told where a robot with a gain rests."""

    def __init__(self, **settings):
        self.numbers = gain_learning(RestGainSettings(**settings), BLEND, PERIOD)
        self.known, self.offset = no_gain(FREE, M), np.zeros(3 * FIXED + FREE)
        rest(self.known, self.numbers, np.zeros(M), BLEND)

    def step(self, drive, found):
        carry(self.known, self.numbers, drive, self.offset, TIP)
        tell(self.known, self.numbers, found, self.offset, TIP)
        return self.offset[3 * FIXED :].copy()


def driven(size=0.02):
    """Drives along a path that moves every one of them in its own way (n, 3) [m]."""
    return size * np.column_stack([np.sin(0.4 * T), np.cos(0.7 * T) - 1.0, np.sin(0.23 * T)])


def test_the_gain_is_found_and_the_offset_does_not_lag():
    learning, deaf = Filter(noise_mm=0.5, forget_s=3000.0), Filter(doubt=1e-6)
    late, lag = [], []
    for drive in driven():
        late.append(learning.step(drive, TRUE @ drive) - TRUE @ drive)
        lag.append(deaf.step(drive, TRUE @ drive) - TRUE @ drive)
    np.testing.assert_allclose(learning.known.gain, TRUE, atol=0.05)
    half = T.size // 2
    assert np.abs(late[half:]).max() < 0.1 * np.abs(lag[half:]).max()


def test_the_end_moves_by_what_the_gain_says():
    learning = Filter()
    learning.known.gain[:] = TRUE
    drive = np.array([0.01, 0.02, -0.03])
    carry(learning.known, learning.numbers, drive, learning.offset, TIP)
    moved = (TRUE @ drive).reshape(3, 3)
    np.testing.assert_allclose(learning.offset[3 * FIXED :], moved.ravel(), atol=1e-15)
    np.testing.assert_allclose(learning.known.moved, moved.mean(axis=0), atol=1e-15)


def test_a_robot_that_rests_is_filtered_with_the_time_constant_of_the_offset():
    learning, place = Filter(), np.full(FREE, 2e-3)
    left = [place - learning.step(np.zeros(M), place) for _ in range(40)]
    np.testing.assert_allclose(np.array(left)[:, 0], 2e-3 * (1.0 - BLEND) ** np.arange(1, 41), rtol=1e-6)
    assert not learning.known.gain.any()


def test_what_is_as_the_model_says_teaches_nothing():
    learning, random = Filter(), np.random.default_rng(1)
    for drive in driven():
        learning.step(drive, 5e-4 * random.standard_normal(FREE))
    assert np.abs(learning.known.gain).max() < 0.1


def test_drives_that_move_together_share_what_they_do():
    learning = Filter(noise_mm=0.5, forget_s=3000.0)
    for way in 0.02 * np.sin(0.4 * T):
        learning.step(np.array([way, way, 0.0]), np.full(FREE, way))
    np.testing.assert_allclose(learning.known.gain[:, 0], learning.known.gain[:, 1], rtol=1e-6)
    np.testing.assert_allclose(learning.known.gain[:, :2].sum(axis=1), 1.0, atol=0.1)
    assert np.abs(learning.known.gain[:, 2]).max() < 1e-9


def test_no_drive_is_believed_to_move_the_end_by_more_than_it_may():
    learning = Filter(most=0.4)
    for drive in driven():
        learning.step(drive, 5.0 * TRUE @ drive)
        ends = learning.known.gain.reshape(3, 3, M).mean(axis=0)
        assert np.linalg.norm(ends, axis=0).max() <= 0.4 + 1e-12


def test_what_is_not_told_again_is_forgotten():
    learning = Filter(forget_s=5.0)
    for drive in driven():
        learning.step(drive, TRUE @ drive)
    held = driven()[-1]
    before = np.abs(learning.known.gain).max()
    for _ in range(int(15.0 / PERIOD)):
        learning.step(held, TRUE @ held)
    assert np.abs(learning.known.gain).max() < 0.1 * before


def test_the_covariance_stays_positive_and_bounded_however_long_it_runs():
    learning = Filter()
    for drive in np.vstack([driven()] * 5):
        learning.step(drive, TRUE @ drive)
        values = np.linalg.eigvalsh(learning.known.covariance)
        assert values.min() > 0.0
    doubt = learning.numbers.doubt
    assert values.max() <= doubt * (1.0 + 1e-9)


@pytest.mark.parametrize("blend", [0.0, 1.0])
def test_without_a_filter_nothing_is_learnt(blend):
    assert gain_learning(RestGainSettings(), blend, PERIOD).doubt == 0.0
    assert gain_learning(None, BLEND, PERIOD).doubt == 0.0
