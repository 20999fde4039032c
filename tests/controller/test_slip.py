"""Laws of the slip that drag follows: two first-order lags in a row, none without time constants."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller.slip import follow_slip, no_slip

PERIOD = 0.01


def followed(lag, time, steps=100):
    """Speeds of cables and drag, and of a node, after a step of drive and node."""
    slip, found = no_slip(1, 3), []
    for _ in range(steps):
        follow_slip(slip, np.ones(1), np.full(3, 2.0), PERIOD, lag, time)
        found.append((slip.cables[0], slip.speed[0], slip.v[2]))
    return PERIOD * np.arange(1, steps + 1), np.array(found).T


def test_without_time_constants_everything_follows_at_once():
    _, (cables, speed, v) = followed(0.0, 0.0, 1)
    assert (cables[0], speed[0], v[0]) == (1.0, 1.0, 2.0)


def test_cables_and_nodes_are_first_order_lags():
    t, (cables, _, v) = followed(0.05, 0.2)
    np.testing.assert_allclose(cables, 1.0 - np.exp(-t / 0.05), atol=1e-12)
    np.testing.assert_allclose(v, 2.0 - 2.0 * np.exp(-t / 0.2), atol=1e-12)


def test_the_drag_of_a_drive_waits_for_the_cable_and_then_for_its_turn():
    lag, time = 0.05, 0.2
    t, (_, speed, _) = followed(lag, time)
    both = 1.0 - (time * np.exp(-t / time) - lag * np.exp(-t / lag)) / (time - lag)
    assert np.abs(speed - both).max() < 0.05  # a cable goes its way within a step at once
    assert speed[-1] == pytest.approx(1.0, abs=0.01)
