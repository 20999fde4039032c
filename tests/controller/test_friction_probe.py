"""Laws of the probe: frictionless robots do not throw their end, rubbing ones do, and nothing else counts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tcrctl.controller.dither import Dither
from tcrctl.controller.dither_settings import DitherSettings
from tcrctl.controller.friction_probe import FrictionProbe, swing, triangle
from tcrctl.experiment.prepare import build_parts, build_plant, prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.loop.loop import run_loop

PERIOD, HALF = 0.05, 2  # a wave of 5 Hz


@pytest.fixture
def probe(tcr700):
    return FrictionProbe(tcr700, HALF, PERIOD)


def told(probe, ends, amplitude=1e-3):
    """Tell a probe of waves of the drives and of ends (n, 3) [m]."""
    for place, end in zip(amplitude * triangle(HALF, len(ends)), ends, strict=True):
        probe.observe(end, place * probe.pattern)
    return probe.thrown


@pytest.mark.parametrize("size", [1.0, 2.5])
def test_it_finds_by_how_much_the_end_is_thrown(probe, size):
    wave = 1e-3 * triangle(HALF, 12)
    end = np.outer(wave, size * np.array([0.6, 0.8, 0.0]))
    assert told(probe, end) == pytest.approx(1e-3 * (size - probe.frictionless), rel=1e-9)


def test_where_the_end_is_and_how_steadily_it_drifts_does_not_count(probe):
    wave = 1e-3 * triangle(HALF, 12)
    drift = np.outer(np.arange(12), [1e-3, -2e-3, 0.5e-3]) + 0.1
    end = np.outer(wave, [2.0, 0.0, 0.0]) + drift
    assert told(probe, end) == pytest.approx(1e-3 * (2.0 - probe.frictionless), rel=1e-9)


def test_it_knows_nothing_before_two_waves_have_told(probe):
    assert told(probe, np.zeros((11, 3))) is None
    probe.observe(np.zeros(3), np.zeros(6))
    assert probe.thrown is not None


def test_a_wave_that_is_too_small_and_an_end_that_is_not_seen_tell_nothing(probe, tcr700):
    assert told(probe, np.zeros((20, 3)), amplitude=1e-6) is None
    assert told(FrictionProbe(tcr700, HALF, PERIOD), np.full((20, 3), np.nan)) is None


@pytest.mark.parametrize("half", [1, 2, 3, 4, 5, 10])
def test_the_wave_that_is_reckoned_with_is_the_one_that_the_dither_makes(half, tcr700):
    """Rates at which half a wave of 5 Hz is one period, an odd number of them, an even one."""
    dither = Dither(DitherSettings(frequency_hz=5.0, least_mm=1.0), 0.1 / half, tcr700, 1.0)
    made = np.cumsum(
        [0.0 * dither.now.place, *(0.1 / half * dither.speed() for _ in range(6 * half))], axis=0
    )
    along = made @ np.sign(made[1]) / (np.abs(made[1]) > 0.0).sum()
    np.testing.assert_allclose(along, 1e-3 * triangle(half, 6 * half + 1), atol=1e-12)


@pytest.mark.parametrize(("period", "probed"), [(0.2, False), (0.1, False), (0.05, True), (0.03, True)])
@pytest.mark.filterwarnings("error")
def test_a_loop_that_is_too_slow_for_the_wave_says_that_it_does_not_know(period, probed, tcr700):
    dither = Dither(DitherSettings(), period, tcr700, 0.05)
    estimate = SimpleNamespace(position=np.zeros(3), drive=np.zeros(6))
    for _ in range(40):
        dither.observe(np.zeros(3), estimate, settling=True)
        estimate.drive = estimate.drive + period * dither.speed()
        estimate.position = 2.0 * np.array([estimate.drive[0], 0.0, 0.0])
    assert (dither.thrown is not None) == probed
    assert dither.slides <= probed


def test_the_swing_of_a_wave_is_its_amplitude():
    t = np.arange(4 * 10) / 10.0
    found = swing(np.column_stack([np.sin(np.pi * t), 3.0 * np.cos(np.pi * t), t]), 10)
    np.testing.assert_allclose(found, [1.0, 3.0, 0.0], atol=1e-12)


def test_a_robot_whose_end_no_cable_moves_sideways_is_not_probed(tcr700):
    rest = tcr700.rest._replace(gain=np.zeros_like(tcr700.rest.gain))
    probe = FrictionProbe(replace(tcr700, rest=rest), HALF, PERIOD)
    assert not probe.pattern.any()
    assert told(probe, np.ones((20, 3))) is None


@pytest.mark.parametrize("name", ["tcr600", "tcr700", "tcr5x4"])
def test_the_pattern_moves_the_end_sideways_and_shortens_nothing(name, request):
    pattern = FrictionProbe(request.getfixturevalue(name), HALF, PERIOD).pattern
    assert np.abs(pattern).max() == 1.0
    assert abs(pattern.sum()) < 1e-3


def thrown_by(name, *overrides, seed=1):
    """What the probe of a whole loop finds within its first second [m]."""
    experiment = prepare(load_spec(name, overrides), seed=seed)
    plant, state = build_plant(experiment)
    parts, _ = build_parts(experiment, plant, state)
    run_loop(replace(parts, steps=round(1.0 / experiment.period)))
    return parts.controller.dither.thrown


FRICTIONLESS = {
    "as shipped": (),
    "a perfect model": ("plant.mismatch=off",),
    "stiff and light": ("plant.mismatch={springs_youngs_modulus: 1.4, density: 0.7}",),
    "tight cables": ("plant.cables.initial_tension=1.3",),
    "backlash": ("plant.drives.backlash_mm=0.2",),
    "a lag": ("plant.drives.lag_s=0.1",),
    "markers beside their nodes": ("plant.cameras.marker_bias_mm=2.0",),
    "lost markers": ("plant.cameras={lost_markers: 0.3, lost_frames: 0.1, age_jitter_ms: 8.0}",),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["letter_t", "fixed_point_rotation"])
def test_no_robot_without_friction_seems_to_rub(name):
    found = {what: thrown_by(name, *sets) for what, sets in FRICTIONLESS.items()}
    assert max(found.values()) < 0.03e-3, found


@pytest.mark.slow
@pytest.mark.parametrize("name", ["letter_t", "fixed_point_rotation"])
def test_the_more_cables_rub_the_more_is_found(name):
    found = [
        thrown_by(name, f"plant.friction.coefficient={mu}", "plant.step_ms=2.5") for mu in (0.03, 0.1, 0.3)
    ]
    assert found[0] > 0.03e-3
    assert found[1] > 2.0 * found[0]
    assert found[2] > 1.5 * found[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["letter_t", "fixed_point_rotation"])
def test_friction_is_found_among_everything_else_that_is_wrong(name):
    found = [thrown_by(name, "plant.realistic=moderate", seed=seed) for seed in (51, 52, 53)]
    assert min(found) > 0.03e-3, found
