"""Laws of the dither: what it does to drives and end, when it grows and shrinks, that it keeps out of the way."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from support.closed_loop import constant, ioc, resting
from tcrctl.controller.controller import build_controller
from tcrctl.controller.dither import Dither, Dithered
from tcrctl.controller.dither_settings import DitherSettings
from tcrctl.errors import SpecError
from tcrctl.experiment.prepare import build_parts, build_plant, prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.loop.loop import run_loop
from tcrctl.robot import pose
from tcrctl.robot.swing import MOST_CABLES, signs

PERIOD = 0.01
WAVE = 20  # periods of a wave of 5 Hz
ALWAYS = {"least_mm": 1.5, "most_mm": 1.5}


FAST = 1.0
"""A speed limit that leaves room for every wave [m/s]."""


def running(robot, period=PERIOD, limit=FAST, **settings):
    return Dither(DitherSettings(**settings), period, robot, limit)


def places(dither, count):
    """Where the drives are after each of the coming periods (count, m) [m]."""
    return PERIOD * np.cumsum([dither.speed() for _ in range(count)], axis=0)


def watch(dither, errors, robot):
    """Tell an end that is beside where it was expected by ``errors`` (n, 3) [m]; returns the amplitudes [m]."""
    found = []
    for error in errors:
        dither.expect(np.zeros(3))
        dither.speed()
        dither.observe(np.asarray(error), resting(robot, dither.now.place))
        found.append(dither.amplitude)
    return np.array(found)


def settle(dither, robot, thrown, steps=80):
    """Let a resting end go sideways by ``thrown`` [m/m] of what the drives do; returns the amplitudes [m]."""
    found, still = [], resting(robot)
    for _ in range(steps):
        dither.speed()
        drive = dither.now.place
        end = still.position + thrown * np.array([0.0, drive[0], 0.0])
        dither.observe(end, replace(still, position=end, drive=drive), settling=True)
        found.append(dither.amplitude)
    return np.array(found)


def test_the_signs_of_the_six_cables_alternate(tcr700):
    assert np.array_equal(signs(tcr700), [1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


@pytest.mark.parametrize("name", ["tcr600", "tcr700", "tcr5x4"])
def test_no_other_signs_pull_less_at_the_end(name, request):
    robot = request.getfixturevalue(name)
    m = robot.n_cables
    gain = pose.drive_gain(robot.rest.q, robot.rest.gain, robot.tip)[:3]

    def pull(trial):
        return np.sum((gain / np.abs(gain).max() @ trial) ** 2) + np.mean(trial) ** 2

    least = min(pull(np.array(trial)) for trial in itertools.product((1.0, -1.0), repeat=m))
    assert pull(signs(robot)) == pytest.approx(least, abs=1e-9)


def test_of_very_many_cables_the_signs_alternate(tcr700):
    many = replace(tcr700, model=tcr700.model._replace(cables=np.zeros((MOST_CABLES + 1, 3))))
    assert np.array_equal(signs(many), (-1.0) ** np.arange(MOST_CABLES + 1))


def test_an_even_number_of_cables_is_not_shortened_on_the_whole(tcr700):
    assert np.abs(places(running(tcr700, **ALWAYS), 3 * WAVE).sum(axis=1)).max() < 1e-12


def test_the_wave_has_the_asked_amplitude_and_frequency_and_no_mean(tcr700):
    found = places(running(tcr700, **ALWAYS), 6 * WAVE)[:, 0]
    np.testing.assert_allclose(found[:WAVE], found[WAVE : 2 * WAVE], atol=1e-15)
    np.testing.assert_allclose(found.reshape(6, WAVE).mean(axis=1), 0.0, atol=1e-15)
    np.testing.assert_allclose(found.reshape(6, WAVE).max(axis=1), 1.5e-3)
    np.testing.assert_allclose(found.reshape(6, WAVE).min(axis=1), -1.5e-3)
    speed = np.diff(found) / PERIOD
    np.testing.assert_allclose(np.abs(speed), 4 * 1.5e-3 * 5.0, rtol=1e-9)  # a triangle
    assert np.count_nonzero(np.diff(np.sign(speed))) == 12


PROBED = 3 * WAVE  # periods until two waves have told


def test_an_end_that_is_thrown_while_it_settles_calls_for_all_of_the_dither(tcr700):
    found = settle(running(tcr700), tcr700, thrown=2.0)
    np.testing.assert_allclose(found[:PROBED], 0.2e-3)  # probe_mm
    np.testing.assert_allclose(found[PROBED:], 2e-3, rtol=0.01)  # most_mm


def test_an_end_that_is_not_thrown_is_left_in_peace(tcr700):
    dither = running(tcr700)
    assert settle(dither, tcr700, thrown=0.3)[-1] == 0.0
    assert not dither.rubs
    dither.speed()
    assert not np.any(places(dither, WAVE))


@pytest.mark.slow
@pytest.mark.parametrize(("away", "wakes"), [(0.7e-3, False), (4e-3, True)])
def test_a_robot_that_slides_is_dithered_only_by_convincing_evidence(tcr700, away, wakes):
    slides, never_tried = running(tcr700), running(tcr700)
    settle(slides, tcr700, thrown=0.3)
    beside = np.tile([away, 0.0, 0.0], (300, 1))
    assert (watch(slides, beside, tcr700)[-1] > 0.0) == wakes
    assert watch(never_tried, beside, tcr700)[-1] > 0.0


def test_the_probing_wave_has_the_pattern_of_the_probe_and_no_mean(tcr700):
    dither, places_of = running(tcr700), []
    for _ in range(2 * WAVE):
        dither.speed()
        dither.observe(np.zeros(3), resting(tcr700), settling=True)
        places_of.append(dither.now.place)
    found = np.array(places_of)[WAVE:]
    pattern = dither.now.place / dither.now.place[0]
    np.testing.assert_allclose(found, np.outer(found[:, 0], pattern), atol=1e-12)
    assert np.abs(found.sum(axis=1)).max() < 1e-5  # no cable without one that gives way
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=1e-12)


def test_a_dither_that_runs_anyway_does_not_probe(tcr700):
    found = settle(running(tcr700, **ALWAYS), tcr700, thrown=2.0)
    np.testing.assert_allclose(found, 1.5e-3)


def test_it_takes_its_part_of_the_speed_limit_and_no_more(tcr700):
    dither = running(tcr700, limit=0.05, speed_part=0.4)
    assert settle(dither, tcr700, thrown=2.0)[PROBED] == pytest.approx(1e-3)
    assert dither.now.fastest == pytest.approx(0.02, rel=0.01)
    assert np.abs(np.diff(places(dither, 3 * WAVE), axis=0)).max() <= 0.02 * PERIOD * (1.0 + 1e-9)


@pytest.mark.parametrize("robot", ["tcr700", "tcr5x4"])
def test_it_grows_while_the_end_goes_elsewhere_and_releases_slowly(robot, request):
    robot = request.getfixturevalue(robot)
    dither = running(robot, release_s=2.0, growth_1_s=5.0)
    away = np.tile([2e-3, 0.0, 0.0], (300, 1))
    grown = watch(dither, away, robot)
    assert np.all(np.diff(grown) >= 0.0)
    assert grown[-1] == pytest.approx(2e-3)  # most_mm
    released = watch(dither, np.zeros((1000, 3)), robot)
    assert np.all(np.diff(released[400:]) < 0.0)
    assert released[-1] / released[-201] == pytest.approx(np.exp(-1.0), rel=0.02)  # in 2 s


@pytest.mark.parametrize(("amplitude", "awake"), [(0.0, 0.0), (0.25e-3, 0.5), (0.5e-3, 1.0), (2e-3, 1.0)])
def test_it_is_awake_from_half_a_millimetre_on(amplitude, awake):
    assert Dithered(amplitude, np.zeros(3)).awake == pytest.approx(awake)


def test_what_is_no_friction_leaves_it_at_rest(tcr700):
    dither = running(tcr700)
    assert not watch(dither, np.tile([0.2e-3, 0.0, 0.0], (500, 1)), tcr700).any()
    assert not np.any(dither.speed())


def test_its_own_trace_does_not_feed_it(tcr700):
    phase = 2 * np.pi * np.arange(2000) / WAVE
    trace = 3e-3 * np.column_stack([np.sin(phase), np.cos(phase), np.sign(np.sin(phase + 0.1))])
    dither = running(tcr700)
    watch(dither, trace[:WAVE], tcr700)  # until the first wave is full
    before = dither.innovation
    watch(dither, trace[WAVE:], tcr700)
    assert dither.innovation < max(0.01e-3, 1e-3 * before)


def test_an_outlier_counts_as_much_as_it_may(tcr700):
    dither = running(tcr700, outlier_mm=1.0)
    watch(dither, np.tile([1.0, 0.0, 0.0], (2000, 1)), tcr700)
    assert dither.innovation == pytest.approx(1e-3)


@pytest.mark.parametrize("position", [None, [np.nan, 0.0, 0.0]])
def test_what_is_not_known_is_not_compared(tcr700, position):
    dither = running(tcr700)
    dither.expect(None if position is None else np.array(position))
    dither.observe(np.ones(3), resting(tcr700))
    assert dither.innovation == 0.0


def test_the_smallest_amplitude_is_not_above_the_largest():
    with pytest.raises(SpecError, match="must be at most most_mm"):
        load_spec("letter_t", ("controller.dither.least_mm=3.0",))


def test_off_and_told_to_stand_still_it_moves_and_keeps_nothing(tcr700):
    told = running(tcr700, **ALWAYS)
    told.stand_still()
    for dither in (told, Dither(None, PERIOD, tcr700, FAST)):
        assert not np.any(places(dither, WAVE))
        assert dither.memory() == {}


def test_its_memory_is_all_that_the_next_steps_depend_on(tcr700):
    """But for the phase, which is time."""
    one, other = running(tcr700, least_mm=0.5), running(tcr700, least_mm=0.5)
    watch(one, np.tile([2e-3, 0.0, 0.0], (3 * WAVE, 1)), tcr700)
    watch(other, np.zeros((3 * WAVE, 3)), tcr700)
    for name, kept in one.memory().items():
        other.memory()[name].values[:] = kept.values
    error = np.tile([1e-3, 1e-3, 0.0], (WAVE, 1))
    np.testing.assert_array_equal(watch(one, error, tcr700), watch(other, error, tcr700))
    np.testing.assert_array_equal(places(one, WAVE), places(other, WAVE))


@pytest.mark.slow
def test_commands_stay_within_speed_limit_and_stroke(tcr700):
    settings = ioc(speed_limit_mm_s=20.0, dither=DitherSettings(least_mm=5.0, most_mm=5.0))
    controller = build_controller(settings, tcr700)
    low, high = tcr700.stroke
    for k in range(40):
        estimate = resting(tcr700, np.full(6, (high - 1e-4, low + 1e-4)[k % 2]))
        command, _ = controller.control(estimate, constant(tcr700, controller, (0.0, 0.0, 0.1)))
        assert np.max(np.abs(command.speed)) <= 0.02 + 1e-12
        assert np.all((command.drive >= low - 1e-12) & (command.drive <= high + 1e-12))


def test_a_step_in_doubt_holds_the_drives_even_so(tcr700):
    controller = build_controller(ioc(dither=DitherSettings(**ALWAYS)), tcr700)
    estimate = replace(resting(tcr700), converged=False)
    command, _ = controller.control(estimate, constant(tcr700, controller))
    assert not np.any(command.speed)


def test_for_a_linearisation_the_controller_stands_still(tcr700):
    controller = build_controller(ioc(dither=DitherSettings(**ALWAYS)), tcr700)
    controller.sharpen()
    command, _ = controller.control(resting(tcr700), constant(tcr700, controller))
    assert np.max(np.abs(command.speed)) < 2e-5
    assert not any("dither" in name for name in controller.memory())


def end_errors(*overrides, steps):
    """Distances of the true end from the wanted one (steps,) [m]."""
    experiment = prepare(load_spec("fixed_point_rotation", overrides))
    plant, state = build_plant(experiment)
    parts, _ = build_parts(experiment, plant, state)
    records = []
    run_loop(replace(parts, steps=steps, record=records.append))
    return np.array([np.linalg.norm(s.truth.position - s.reference.position) for s in records])


@pytest.mark.slow
def test_with_friction_in_the_holes_the_error_is_a_third_or_less():
    rubbing = ("plant.friction={coefficient: 0.1}", "plant.step_ms=2.5")
    errors = {
        dither: end_errors(*rubbing, f"controller.dither={dither}", steps=500)
        for dither in ("off", "{least_mm: 2.0}")
    }
    rms = [np.sqrt(np.mean(e[100:] ** 2)) for e in errors.values()]
    assert rms[1] < rms[0] / 3.0
