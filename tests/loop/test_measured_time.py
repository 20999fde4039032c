"""What a log of a paced run tells of its time is what the clock saw, however often the run was stopped."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.loop.measured_time import begun, beyond
from tcrctl.loop.pacing import RealTime, Unpaced

PERIOD = 0.05


class Clock:
    """Goes on when somebody sleeps or works; a stopped process sees it jump."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def paced(took, stopped):
    """Lateness, true beginning and end of steps that take ``took`` [s], each after a pause of the whole process."""
    clock = Clock()
    pace = RealTime(PERIOD, clock=clock, sleep=clock.sleep)
    late, at = [], []
    for k, (busy, pause) in enumerate(zip(took, stopped, strict=True)):
        late.append(pace.wait(k * PERIOD))
        at.append(clock.now)
        clock.now += busy + pause
    return np.array(late), np.array(at), clock.now


durations = st.lists(
    st.tuples(st.floats(0.0, 0.2), st.sampled_from([0.0, 0.0, 0.0, 0.03, 5.0])), min_size=1, max_size=40
)


@given(durations)
def test_the_beginnings_of_all_steps_are_those_that_the_clock_saw(steps):
    took, stopped = np.array(steps).T
    late, at, _ = paced(took, stopped)
    period = np.full(len(late), PERIOD)
    found = begun(PERIOD * np.arange(len(late)), late, period)
    assert found - found[0] == pytest.approx(at - at[0], abs=1e-9)


@given(durations)
def test_the_length_of_a_run_is_that_of_the_clock_but_for_less_than_a_period(steps):
    took, stopped = np.array(steps).T
    late, at, end = paced(took, stopped)
    period = np.full(len(late), PERIOD)
    length = PERIOD * len(late) + beyond(late, took + stopped, period)
    assert length >= PERIOD * len(late)
    assert abs(length - (end - at[0])) <= PERIOD + 1e-9


@pytest.mark.parametrize("stopped_s", [0.06, 5.0, 3600.0])
def test_a_stopped_process_shows_once_and_in_full(stopped_s):
    stopped = np.zeros(20)
    stopped[7] = stopped_s
    late, at, _ = paced(np.full(20, 0.001), stopped)
    found = begun(PERIOD * np.arange(20), late, np.full(20, PERIOD))
    between = np.diff(found)
    assert between[7] == pytest.approx(max(stopped_s + 0.001, PERIOD))
    assert np.delete(between, 7) == pytest.approx(PERIOD, abs=0.02)
    assert found[-1] - found[0] == pytest.approx(at[-1] - at[0])


def test_the_time_of_events_never_goes_back_and_lies_between_two_steps_until_the_last():
    clock = Clock()
    pace = RealTime(PERIOD, clock=clock, sleep=clock.sleep)
    seen = []
    for k in range(6):
        pace.wait(k * PERIOD)
        for _ in range(3):
            seen.append(pace.moment())
            assert k * PERIOD <= seen[-1] + 1e-9 <= (k + 1) * PERIOD + 2e-9
            clock.now += 2.0 if k == 3 else 0.01
    assert seen == sorted(seen)
    pace.end()
    assert pace.moment() >= seen[-1]
    clock.now += 1.0
    assert pace.moment() >= seen[-1] + 1.0


def test_how_far_a_run_is_behind_counts_what_the_step_was_late_and_what_it_takes():
    clock = Clock()
    pace = RealTime(PERIOD, clock=clock, sleep=clock.sleep)
    assert pace.behind() == 0.0
    pace.wait(0.0)
    clock.now += 0.3 * PERIOD
    assert pace.behind() == pytest.approx(0.3 * PERIOD)
    pace.wait(PERIOD)
    assert pace.behind() == pytest.approx(0.0, abs=1e-9)
    clock.now += 3.0
    pace.wait(2 * PERIOD)  # begins late
    clock.now += 0.5
    assert pace.behind() == pytest.approx(3.5 - PERIOD)


def test_a_run_that_no_clock_paces_has_no_time_but_that_of_its_steps():
    pace = Unpaced()
    pace.wait(3.0)
    pace.end()
    assert pace.moment() == pace.time() == 3.0
    assert pace.behind() == 0.0
