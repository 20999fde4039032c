"""Laws of predictions for drives that lag: known answers, superposition, and what is on its way arrives."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller.drive_lag import DriveLag, with_lag

STEP = 0.05
T = STEP * np.arange(1, 41)


def lagging(responses, lag=0.0, dead_time=0.0, behind=0.0, queue=0.0):
    """Answer to a ramp of the set-point, and the free motion, for an answer (40,) to a ramp of the cable."""
    change = np.zeros((T.size, 1, 2))
    change[:, 0, 0] = responses
    with_lag(change, STEP, DriveLag(lag, dead_time), np.array([behind]), np.array([queue]))
    return change[:, 0, 0], change[:, 0, 1]


def test_drives_without_lag_and_with_nothing_on_its_way_change_nothing():
    ramp, free = lagging(np.sin(T))
    assert np.array_equal(ramp, np.sin(T))
    assert not free.any()


@pytest.mark.parametrize("lag", [0.01, 0.03, 0.1, 0.25])
def test_a_cable_follows_a_ramp_as_a_first_order_lag_does(lag):
    ramp, _ = lagging(T, lag)
    np.testing.assert_allclose(ramp, T - lag * (1.0 - np.exp(-T / lag)), atol=1e-12)


@pytest.mark.parametrize("lag", [0.03, 0.1])
def test_what_drives_are_behind_arrives_with_their_lag(lag):
    _, free = lagging(T, lag, behind=2e-3)
    np.testing.assert_allclose(free, 2e-3 * (1.0 - np.exp(-T / lag)), atol=1e-15)


def test_without_lag_it_arrives_within_two_instants():
    _, free = lagging(T, behind=2e-3)
    assert free[1] == pytest.approx(2e-3, rel=0.02)
    assert free[-1] == pytest.approx(2e-3, rel=1e-9)


def test_a_lag_is_the_convolution_with_its_impulse_answer():
    """Against fine quadrature, for an answer that is straight between instants."""
    lag, fine = 0.08, 400
    responses = np.cumsum(np.random.default_rng(0).standard_normal(T.size))
    at = np.linspace(0.0, T[-1], fine * T.size + 1)
    curve = np.interp(at, np.concatenate([[0.0], T]), np.concatenate([[0.0], responses]))
    slope = np.repeat(np.diff(np.concatenate([[0.0], responses])) / STEP, fine)
    middle = 0.5 * (at[1:] + at[:-1])
    ramp, _ = lagging(responses, lag)
    for n in (0, 7, 39):
        seen = middle < T[n]
        missing = np.sum(slope[seen] * np.exp(-(T[n] - middle[seen]) / lag)) * (at[1] - at[0])
        assert ramp[n] == pytest.approx(curve[fine * (n + 1)] - lag * missing / lag * 1.0, abs=1e-3)


@pytest.mark.parametrize("dead_time", [0.05, 0.075, 0.2])
def test_a_dead_time_shifts_the_answer(dead_time):
    ramp, _ = lagging(T, dead_time=dead_time)
    np.testing.assert_allclose(ramp, np.maximum(T - dead_time, 0.0), atol=1e-12)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_what_was_sent_within_the_dead_time_arrives_in_the_end(lag):
    _, free = lagging(T, lag, dead_time=0.1, queue=3e-3)
    assert free[0] < 3e-3
    assert free[-1] == pytest.approx(3e-3, rel=1e-6)
