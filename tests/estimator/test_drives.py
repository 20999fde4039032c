"""Laws of what is believed of drives: they are where a real one would be, and their lag is found."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.estimator.drives import BelievedDrives
from tcrctl.estimator.lag_search import CANDIDATES, LagSearch

PERIOD, FINE = 0.05, 500


def driven(lag, dead_time=0.0, count=200):
    """Set-points and places of drives of a lag at the ends of control periods, by many small steps (n, 2) [m]."""
    rng = np.random.default_rng(4)
    set_points = np.cumsum(np.vstack([np.zeros(2), 1e-3 * rng.standard_normal((count, 2))]), axis=0)
    at = np.linspace(0.0, count, FINE * count + 1) * PERIOD
    told = np.column_stack(
        [np.interp(at - dead_time, PERIOD * np.arange(count + 1), set_points[:, c]) for c in range(2)]
    )
    if lag == 0.0:
        return set_points, told[::FINE]
    x, h, places = np.zeros(2), PERIOD / FINE, [np.zeros(2)]
    for k in range(1, at.size):
        middle = 0.5 * (told[k] + told[k - 1])
        x = middle + np.exp(-h / lag) * (x - middle)
        if k % FINE == 0:
            places.append(x)
    return set_points, np.array(places)


def believed(drives, reports, set_points):
    """Where the drives are believed to be after every step (n, m) [m]."""
    found = []
    for reported, set_point in zip(reports, set_points, strict=True):
        drives.update(reported, set_point)
        found.append(drives.reached.copy())
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.0, 0.03, 0.1, 0.25])
def test_drives_that_report_set_points_are_where_their_lag_leaves_them(lag):
    set_points, places = driven(lag)
    found = believed(BelievedDrives(lag, 0.0, "set_point", PERIOD), set_points, set_points)
    np.testing.assert_allclose(found, places, atol=2e-7)


@pytest.mark.parametrize("dead_time", [0.05, 0.08, 0.2])
def test_set_points_arrive_after_the_dead_time(dead_time):
    set_points, places = driven(0.0, dead_time)
    drives = BelievedDrives(0.0, dead_time, "set_point", PERIOD)
    np.testing.assert_allclose(believed(drives, set_points, set_points), places, atol=1e-12)
    np.testing.assert_allclose(drives.arrived, places[-1], atol=1e-12)
    np.testing.assert_allclose(drives.set_point, set_points[-1])


@pytest.mark.slow
def test_encoders_are_believed():
    set_points, places = driven(0.1)
    found = believed(BelievedDrives(0.05, 0.0, "encoder", PERIOD), places, set_points)
    assert np.array_equal(found, places)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.0, 0.02, 0.03, 0.1, 0.25])
def test_the_lag_of_drives_with_encoders_is_found(lag):
    set_points, places = driven(lag)
    drives = BelievedDrives(None, 0.0, "encoder", PERIOD)
    believed(drives, places, set_points)
    assert drives.lag == pytest.approx(lag, abs=1e-9)


@pytest.mark.slow
def test_a_lag_between_two_candidates_gives_one_of_them():
    set_points, places = driven(0.034)
    drives = BelievedDrives(None, 0.0, "encoder", PERIOD)
    believed(drives, places, set_points)
    assert abs(drives.lag - 0.034) <= 0.01


def test_the_lag_is_found_through_the_counts_of_an_encoder():
    set_points, places = driven(0.06)
    drives = BelievedDrives(None, 0.0, "encoder", PERIOD)
    believed(drives, 1e-5 * np.round(places / 1e-5), set_points)
    assert drives.lag == pytest.approx(0.06, abs=0.011)


def test_drives_that_have_not_moved_have_no_lag():
    search = LagSearch(PERIOD)
    for _ in range(500):
        search.observe(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))
    assert search.lag == CANDIDATES[0] == 0.0


@pytest.mark.slow
def test_a_lag_that_changes_is_followed():
    drives = BelievedDrives(None, 0.0, "encoder", PERIOD)
    for lag in (0.1, 0.03):
        set_points, places = driven(lag, count=1200)
        believed(drives, places, set_points)
        assert drives.lag == pytest.approx(lag, abs=1e-9)


def test_what_has_not_arrived_is_remembered():
    drives = BelievedDrives(0.1, 0.12, "set_point", PERIOD)
    drives.update(np.zeros(2), np.ones(2))
    assert set(drives.memory()) == {"sent", "arrived", "reached"}
    assert not BelievedDrives(None, 0.0, "encoder", PERIOD).memory()
