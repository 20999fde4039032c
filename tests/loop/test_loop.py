"""The control loop, its pace and its guard, with fake parts and a fake clock."""

from __future__ import annotations

import signal
import threading

import numpy as np
import pytest

from support.loop_fakes import CABLES, PERIOD, Clock, FakeController, FakeEstimator, FakePlant, StraightLine
from tcrctl.errors import DeviceError, RunInterruptedError, SafetyLimitError, StoppedError
from tcrctl.loop.interruption import Interruption, signals_exit
from tcrctl.loop.loop import Parts, run_loop, step_count, tick
from tcrctl.loop.pacing import LONGEST_NAP, RealTime, Unpaced
from tcrctl.loop.safety import SafetyGuard, SafetyLimits
from tcrctl.picture.picture import Unjudged

LIMITS = SafetyLimits(position_error=0.06, tension=60.0)


def loop(
    plant=None, estimator=None, controller=None, *,
    pace=None, record=None, duration=1.0, limits=LIMITS, picture=None,
):  # fmt: skip
    """Run the loop with fakes where nothing else is given; returns the records, also of a loop that raised."""
    records = []
    error = None
    try:
        run_loop(
            Parts(
                trajectory=StraightLine(),
                plant=plant or FakePlant(),
                estimator=estimator or FakeEstimator(),
                controller=controller or FakeController(),
                period=PERIOD,
                steps=step_count(duration, PERIOD),
                pace=pace or Unpaced(),
                guard=SafetyGuard(limits),
                record=record or records.append,
                picture=picture or Unjudged(),
            )
        )
    except StoppedError as stopped:
        error = stopped
    return records, error


@pytest.mark.parametrize(
    ("duration", "period", "steps"),
    [(1.0, 0.05, 20), (1.01, 0.05, 21), (0.3, 0.1, 3), (0.01, 0.05, 1), (60.0, 1.0 / 30.0, 1800)],
)
def test_the_steps_cover_the_duration_and_no_more(duration, period, steps):
    assert step_count(duration, period) == steps


def test_every_step_is_recorded_with_its_index_and_time():
    records, error = loop()
    assert error is None
    assert [r.k for r in records] == list(range(20))
    assert [r.t for r in records] == [k * PERIOD for k in range(20)]
    assert {r.period for r in records} == {PERIOD}
    assert all(r.truth is not None for r in records)


def test_the_controller_gets_the_reference_at_its_instants():
    controller = FakeController()
    records, _ = loop(controller=controller)
    for k, reference in enumerate(controller.references):
        assert reference.t == k * PERIOD
        assert reference.position[0] == pytest.approx(0.01 * k * PERIOD)
        assert reference.ahead_position[:, 0] == pytest.approx(0.01 * (k * PERIOD + FakeController.ahead))
        assert records[k].reference is reference


def test_the_estimator_gets_what_was_applied_not_what_was_wanted():
    estimator = FakeEstimator()
    records, _ = loop(estimator=estimator)
    first, *later = estimator.applied
    assert not first.speed.any()
    np.testing.assert_array_equal(first.drive, np.full(CABLES, 0.25))
    for before, applied in zip(records, later, strict=False):
        np.testing.assert_array_equal(applied.speed, 0.5 * before.wanted.speed)
        assert applied is before.applied


def test_a_step_measures_then_writes():
    plant = FakePlant()
    loop(plant)
    assert plant.calls == ["read", "truth", "write"] * 20


def test_the_loop_is_one_tick_after_the_other():
    """A tick knows nothing of the ones before but what was applied; so stability and replay can use it alone."""
    records, _ = loop()
    parts = Parts(StraightLine(), FakePlant(), FakeEstimator(), FakeController(), PERIOD, steps=0)
    applied = None
    for k, record in enumerate(records):
        step, broken = tick(parts, k, applied)
        applied = step.applied
        assert broken is None
        assert (step.k, step.t) == (record.k, record.t)
        np.testing.assert_array_equal(applied.speed, record.applied.speed)
        np.testing.assert_array_equal(step.reference.ahead_position, record.reference.ahead_position)


def test_an_error_of_the_plant_ends_the_loop_at_once():
    plant = FakePlant(fails_at=7, error=DeviceError("cable 2 does not answer"))
    records = []
    with pytest.raises(DeviceError, match="cable 2"):
        loop(plant, record=records.append)
    assert [r.k for r in records] == list(range(7))


def held(record):
    return not record.applied.speed.any() and (record.applied.drive == record.measurement.drive).all()


def test_one_unsolved_step_is_tolerated_two_in_a_row_are_not():
    records, error = loop(controller=FakeController(failing={3, 5, 9}))
    assert (len(records), error) == (20, None)
    records, error = loop(controller=FakeController(failing={3, 9, 10}))
    assert isinstance(error, SafetyLimitError)
    assert (error.step, error.value, error.limit, error.exit_code) == (10, 2, 1, 4)
    assert "no solution found" in str(error)
    assert [r.k for r in records] == list(range(11))
    assert held(records[-1])


def test_an_estimator_that_fails_twice_in_a_row_stops_the_run():
    records, error = loop(estimator=FakeEstimator(failing={4, 5}))
    assert isinstance(error, SafetyLimitError)
    assert error.step == 5
    assert "estimator" in str(error)
    assert held(records[-1])


def test_failures_of_estimator_and_controller_add_up():
    _, error = loop(estimator=FakeEstimator(failing={4}), controller=FakeController(failing={5}))
    assert isinstance(error, SafetyLimitError)
    assert error.step == 5


@pytest.mark.parametrize("offset", [0.0601, -0.5, np.nan, np.inf])
def test_a_position_error_beyond_the_limit_holds_the_drives_and_stops(offset):
    records, error = loop(estimator=FakeEstimator(offset={6: offset}))
    assert isinstance(error, SafetyLimitError)
    assert (error.step, error.quantity, error.unit, error.limit) == (
        6,
        "estimated position error",
        "mm",
        60.0,
    )
    assert error.value == pytest.approx(1e3 * abs(offset), nan_ok=True)
    assert len(records) == 7
    assert held(records[-1])
    assert records[-1].wanted.speed.any()


def test_a_position_error_within_the_limit_goes_on():
    assert loop(estimator=FakeEstimator(offset={6: 0.0599}))[1] is None


@pytest.mark.parametrize("tension", [60.1, np.nan])
def test_a_tension_beyond_the_limit_holds_the_drives_and_stops(tension):
    records, error = loop(estimator=FakeEstimator(tension={2: tension}))
    assert isinstance(error, SafetyLimitError)
    assert (error.step, error.unit, error.limit) == (2, "N", 60.0)
    assert held(records[-1])


@pytest.mark.parametrize("speed", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_no_number_is_never_sent(speed):
    plant = FakePlant()
    records, error = loop(plant, controller=FakeController(speeds={8: speed}))
    assert isinstance(error, SafetyLimitError)
    assert error.step == 8
    assert all(np.isfinite(command.speed).all() for command in plant.written)
    assert not np.isfinite(records[-1].wanted.speed).any()
    assert held(records[-1])


def test_the_sections_of_a_step_are_timed():
    clock = Clock()
    plant = FakePlant(clock, seconds=0.004)
    records, _ = loop(plant, pace=RealTime(PERIOD, clock=clock, sleep=clock.sleep))
    assert [r.timing.write for r in records] == pytest.approx([0.004] * 20)
    assert {r.timing.read for r in records} == {0.0}


def begins(clock, plant, steps=20, **options):
    """Times at which the steps begin, from the first one on, and how late each says it is."""
    options.setdefault("pace", RealTime(PERIOD, clock=clock, sleep=clock.sleep))
    times = []
    read = plant.read

    def noted():
        times.append(clock.time)
        return read()

    plant.read = noted
    records, _ = loop(plant, duration=steps * PERIOD, **options)
    return np.array(times) - times[0], np.array([r.timing.lateness for r in records])


def test_paced_steps_begin_at_absolute_deadlines():
    clock = Clock()
    times, late = begins(clock, FakePlant(clock, seconds=0.02))
    assert times == pytest.approx(PERIOD * np.arange(20))
    assert late == pytest.approx(np.zeros(20), abs=1e-9)
    assert max(clock.naps) <= LONGEST_NAP


def test_a_step_that_is_a_little_late_does_not_move_the_others():
    clock = Clock()
    plant = FakePlant(clock, seconds=0.0)
    write = plant.write

    def slow_once(command):
        clock.time += 1.4 * PERIOD * (len(plant.written) == 4)
        return write(command)

    plant.write = slow_once
    times, late = begins(clock, plant)
    assert late[5] == pytest.approx(0.4 * PERIOD)
    expected = PERIOD * np.arange(20)
    expected[5] += 0.4 * PERIOD
    assert times == pytest.approx(expected)


def test_missed_steps_are_not_made_up_for_in_a_burst():
    clock = Clock()
    times, late = begins(clock, FakePlant(clock, seconds=0.01, slow_steps={4, 9}))
    assert late[5] == pytest.approx(2.5 * PERIOD)
    assert np.diff(times).min() >= PERIOD * (1.0 - 1e-9)
    assert times[-1] == pytest.approx((19 + 5) * PERIOD)


def test_what_waits_waits_by_the_clock_in_which_missed_steps_count():
    clock, seen = Clock(), []
    pace = RealTime(PERIOD, clock=clock, sleep=clock.sleep)
    assert pace.elapsed() == 0.0

    class Watched(Unjudged):
        def judged(self, measured, elapsed):
            seen.append(elapsed)
            return measured

    times, _ = begins(clock, FakePlant(clock, seconds=0.01, slow_steps={4, 9}), pace=pace, picture=Watched())
    assert seen == pytest.approx(times)
    assert seen[-1] == pytest.approx(pace.time() + 5 * PERIOD, abs=PERIOD)
    seen.clear()
    loop(picture=Watched())
    assert seen == pytest.approx(PERIOD * np.arange(20))  # no clock paces it


def test_steps_that_are_always_too_long_run_at_their_own_rate():
    clock = Clock()
    times, _ = begins(clock, FakePlant(clock, seconds=1.5 * PERIOD))
    assert np.diff(times) == pytest.approx(np.full(19, 1.5 * PERIOD))


@pytest.mark.parametrize("pace", ["unpaced", "real time"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_loop_between_two_steps(pace, number):
    clock, records = Clock(), []
    plant = FakePlant(clock)

    def record(step):
        records.append(step)
        if step.k == 5:
            signal.raise_signal(number)

    with Interruption() as interruption:
        check = interruption.check
        made = (
            Unpaced(check) if pace == "unpaced" else RealTime(PERIOD, check, clock=clock, sleep=clock.sleep)
        )
        with pytest.raises(RunInterruptedError) as caught:
            loop(plant, pace=made, record=record)
    assert caught.value.exit_code == 128 + number
    assert len(records) == len(plant.written) == 6


def test_a_signal_ends_a_long_wait_within_a_nap():
    clock = Clock()

    def sleep(duration):
        clock.sleep(duration)
        if len(clock.naps) == 3:
            signal.raise_signal(signal.SIGTERM)

    with Interruption() as interruption:
        pace = RealTime(10.0, interruption.check, clock=clock, sleep=sleep)
        pace.wait(0.0)
        with pytest.raises(RunInterruptedError):
            pace.wait(10.0)
    assert clock.time - 100.0 == pytest.approx(3 * LONGEST_NAP)


def test_a_second_ctrl_c_acts_at_once():
    with Interruption():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with Interruption():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(SystemExit) as caught:
            signal.raise_signal(signal.SIGTERM)
    assert caught.value.code == 143


def test_signals_are_given_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with Interruption():
        assert signal.getsignal(signal.SIGTERM) is not before[1]
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == before


def test_outside_the_main_thread_no_signal_is_taken():
    def enter():
        with signals_exit(), Interruption() as interruption:
            interruption.check()
            seen.append(signal.getsignal(signal.SIGTERM))

    seen, before = [], signal.getsignal(signal.SIGTERM)
    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [before]
