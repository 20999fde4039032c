"""Laws of the share of drag: it is found, it is 0 where there is none, noise and what lasts do not make one."""

from __future__ import annotations

import numpy as np
import pytest

from support.closed_loop import ioc, resting, situation
from tcrctl.controller.drag_share import MOST, forget, learn, learning, nothing_known
from tcrctl.controller.multi_step import MultiStep

PERIOD = 0.05
T = PERIOD * np.arange(1200)


def found(r, h, period=PERIOD):
    known, numbers = nothing_known(), learning(period)
    for one, other in zip(r, h, strict=True):
        learn(known, numbers, one, other)
    return float(known.share[0])


def drag(size=3e-3):
    """Displacements by usual drag along a path with turns (n, 3) [m]."""
    return size * np.column_stack([np.sin(0.8 * T), np.sign(np.sin(0.5 * T)), 0.3 * np.cos(1.7 * T)])


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 2.5])
def test_the_share_is_found_beside_what_lasts(share):
    h = drag(6e-3)
    lasting = np.array([0.02, -0.01, 0.005]) + 1e-5 * T[:, None]
    assert found(share * h + lasting, h) == pytest.approx(share, abs=0.02)


def test_the_motion_of_the_dither_does_not_count():
    h = drag()
    wave = 1.5e-3 * np.column_stack([np.zeros(T.size), np.zeros(T.size), np.cos(2 * np.pi * 5.0 * T)])
    assert found(h + wave, h) == pytest.approx(1.0, abs=0.02)


def test_noise_makes_no_drag():
    noise = 1e-3 * np.random.default_rng(1).standard_normal((T.size, 3))
    assert found(noise, drag()) < 0.05


def test_nothing_is_believed_of_a_robot_that_has_hardly_moved():
    h = drag(size=1e-6)
    assert found(h, h) < 0.01


@pytest.mark.parametrize(("share", "bound"), [(-2.0, 0.0), (9.0, MOST)])
def test_it_stays_within_its_bounds(share, bound):
    assert found(share * drag(), drag()) == bound


def test_it_is_forgotten_when_nothing_is_told_any_more():
    known, numbers = nothing_known(), learning(PERIOD)
    for h in drag():
        learn(known, numbers, h, h)
    for _ in range(4000):
        forget(known, numbers)
    assert known.share[0] < 0.05


@pytest.mark.parametrize("offset", ["off", {"filter_s": 0.3}])
def test_drag_that_was_not_learnt_is_not_counted(tcr600, offset):
    """Also where nothing learns it, because the offset is off."""
    settings = ioc(offset=offset).prediction
    speed = np.array([0.01, -0.005, 0.02])

    def free(amplitude):
        at = situation(tcr600, resting(tcr600), speed, amplitude)
        return MultiStep(settings, PERIOD, tcr600, 0.0).predict(at).prediction

    calm, dithered = free(0.0), free(2e-3)
    np.testing.assert_array_equal(dithered.free, calm.free)
    np.testing.assert_array_equal(dithered.gain, calm.gain)
