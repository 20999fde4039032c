"""Drives between set-point and cable: lag, dead time, limits, play, winch, counts, and what is reported."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcr_hardware.servo import DeadTime, Servo, ServoSettings
from tcrctl.plant.drives import SimulatedDrives
from tcrctl.plant.reality_settings import DriveSettings

STEP = 1e-3


def build(start=(0.0, 0.0), step=STEP, **settings):
    return SimulatedDrives(DriveSettings(**settings), np.array(start), step)


def driven(drives, speed, steps):
    """Cable taken in after every step (steps, m) [m]; ``speed`` is a number or a function of the step."""
    rate = speed if callable(speed) else lambda k: speed
    return np.array([drives.move(np.full(drives.set_point.size, rate(k))) for k in range(steps)])


def test_ideal_drives_do_what_they_are_told():
    drives = build()
    cable = driven(drives, lambda k: 0.03 * np.cos(0.01 * k), 1000)
    np.testing.assert_allclose(cable[-1], drives.set_point, rtol=0, atol=1e-14)
    np.testing.assert_allclose(drives.reported(), drives.set_point, rtol=0, atol=1e-14)


@pytest.mark.parametrize("step", [5e-4, 1e-3, 5e-3])
def test_the_lag_is_first_order_whatever_the_step(step):
    """x = v (t - tau (1 - exp(-t / tau))) on a ramp from rest."""
    lag, v = 0.03, 0.02
    t = step * np.arange(1, 1 + round(0.2 / step))
    cable = driven(build(step=step, lag_s=lag), v, t.size)[:, 0]
    np.testing.assert_allclose(cable, v * (t - lag * (1.0 - np.exp(-t / lag))), rtol=0, atol=1e-13)


@pytest.mark.parametrize("dead_ms", [1.0, 7.0, 7.5, 50.0])
def test_the_dead_time_shifts_and_changes_nothing(dead_ms):
    rate = 0.02
    cable = driven(build(dead_time_s=dead_ms / 1e3), rate, 200)[:, 0]
    t = STEP * np.arange(1, 201)
    np.testing.assert_allclose(cable, rate * np.maximum(0.0, t - dead_ms / 1e3), rtol=0, atol=1e-13)


@given(st.floats(1e-3, 0.2), st.lists(st.tuples(st.floats(1e-4, 0.03), st.floats(-5.0, 5.0)), min_size=1))
def test_a_delayed_signal_lies_between_the_values_that_were_sent(delay, sent):
    late, values = DeadTime(delay, 0.0), [0.0]
    for dt, value in sent:
        values.append(value)
        assert min(values) <= late(value, dt) <= max(values)


def test_the_acceleration_is_limited_and_nothing_overshoots():
    drives = build(acceleration_limit_mm_s2=100.0)
    cable = driven(drives, lambda k: 0.04 if k < 500 else 0.0, 2000)[:, 0]
    acceleration = np.diff(np.concatenate([[0.0, 0.0], cable]), 2) / STEP**2
    assert np.abs(acceleration).max() <= 0.1 * (1.0 + 1e-9)
    assert cable[100] < 0.3 * 0.04 * 0.1
    assert cable.max() <= 0.02 + 1e-9
    assert cable[-1] == pytest.approx(0.02, abs=1e-6)


def test_play_loses_its_width_at_every_reversal_and_the_encoder_does_not_see_it():
    drives = build(backlash_mm=0.2, reports="encoder")
    there = driven(drives, 0.01, 1000)[-1]
    np.testing.assert_allclose(there, 0.01 - 1e-4, rtol=0, atol=1e-12)
    waiting = driven(drives, -0.01, 20)
    assert np.ptp(waiting) == 0.0
    back = driven(drives, -0.01, 980)[-1]
    np.testing.assert_allclose(back, 1e-4, rtol=0, atol=1e-12)
    np.testing.assert_allclose(drives.reported(), 0.0, rtol=0, atol=1e-12)


@given(st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=60))
def test_play_never_gets_wider(speeds):
    drives = build(backlash_mm=0.3)
    for speed in speeds:
        cable = drives.move(np.array([speed, -speed]))
        assert np.abs(cable - drives.set_point).max() <= 1.5e-4 + 1e-12


def test_winch_and_zero_are_wrong_and_the_drives_do_not_know():
    drives = build(start=(0.0, 0.01), radius_error=(0.02, -0.01), zero_error_mm=(1.0, -0.5))
    np.testing.assert_allclose(drives.cable(), [1e-3, 0.01 * 0.99 - 0.5e-3], rtol=0, atol=1e-15)
    cable = driven(drives, 0.01, 1000)[-1]
    np.testing.assert_allclose(cable, [1e-3 + 0.01 * 1.02, 0.02 * 0.99 - 0.5e-3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(drives.reported(), [0.01, 0.02], rtol=0, atol=1e-12)


def test_an_encoder_counts_and_a_set_point_is_rounded_to_counts():
    drives = build(quantisation_mm=0.01)
    cable = driven(drives, 0.001, 57)
    counts = cable / 1e-5
    np.testing.assert_allclose(counts, np.round(counts), rtol=0, atol=1e-9)
    np.testing.assert_allclose(drives.reported(), 6e-5, rtol=0, atol=1e-15)
    assert drives.set_point == pytest.approx([5.7e-5] * 2)


@pytest.mark.parametrize("count", [0.0, 0.01, 0.0237])
def test_at_the_start_the_drives_stand_where_they_shall_be_to_the_last_bit(count):
    drives = build(start=(0.0123456, -0.00307), quantisation_mm=count)
    assert np.array_equal(drives.reported(), drives.set_point)


@pytest.mark.parametrize("reports", ["set_point", "encoder"])
def test_what_is_reported_can_be_chosen(reports):
    drives = build(lag_s=0.1, reports=reports)
    cable = driven(drives, 0.02, 50)[-1]
    expected = drives.set_point if reports == "set_point" else cable
    np.testing.assert_allclose(drives.reported(), expected, rtol=0, atol=1e-14)
    assert abs(cable[0] - drives.set_point[0]) > 4e-4


def test_a_drive_without_faults_takes_in_what_its_encoder_says_to_the_last_bit():
    servo = Servo(ServoSettings())
    for k in range(200):
        servo.advance(1000.0 * np.sin(0.1 * k), 0.002)
        assert servo.output == servo.position
