"""Sines, chirps and steps of the drives: continuous, about their middle, from rest to rest, within all limits."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.errors import InfeasibleError, SpecError
from tcrctl.experiment.prepare import plan, prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.trajectory.steps import build_steps
from tcrctl.trajectory.wave import build_wave
from tcrctl.trajectory.wave_settings import ChirpSettings, SineSettings, StepsSettings

AMPLITUDE = (6.0, -3.0, -3.0)
MIDDLE = (15.0, 15.0, 15.0)
COMMON = {"amplitude_mm": AMPLITUDE, "middle_mm": MIDDLE, "lead_in_s": 1.0, "settle_s": 1.0, "move_s": 2.0}
SINE = SineSettings(kind="sine", frequency_hz=0.5, cycles=6, **COMMON)
CHIRPS = {
    spacing: ChirpSettings(kind="chirp", from_hz=0.2, to_hz=1.6, duration_s=15.0, spacing=spacing, **COMMON)
    for spacing in ("linear", "exponential")
}
WAVES = {"sine": SINE, **CHIRPS}


@pytest.mark.parametrize("name", WAVES)
def test_a_wave_is_continuous_stays_on_its_line_and_ends_where_it_began(name, tcr600):
    wave = build_wave(WAVES[name], tcr600)
    t = np.linspace(-1.0, wave.duration + 1.0, 40001)
    drive = wave.drive(t)
    fastest = 2.0 * np.pi * WAVES[name].fastest_hz * 6e-3 + 15.0 / 8.0 * 15e-3 / 2.0 + 6e-3
    assert np.abs(np.diff(drive, axis=0)).max() <= fastest * (t[1] - t[0])
    np.testing.assert_array_equal(drive[[0, -1]], 0.0)
    waving = (t > 3.0) & (t < wave.duration - 3.0)
    swing = (drive[waving] - 15e-3) / (1e-3 * np.array(AMPLITUDE))
    np.testing.assert_allclose(swing, swing[:, :1] * np.ones(3), atol=1e-12)
    assert 0.98 <= np.abs(swing).max() <= 1.0


def crossings(wave, settings):
    """Times at which the first drive goes through its middle, after the beginning of the wave."""
    x = np.linspace(0.05, settings.wave_s - 0.05, 200001)
    swing = wave.drive(3.0 + x)[:, 0] - 15e-3
    at = np.flatnonzero(np.sign(swing[:-1]) != np.sign(swing[1:]))
    return x[at] - swing[at] * (x[1] - x[0]) / (swing[at + 1] - swing[at])


def test_a_sine_has_its_frequency(tcr600):
    found = crossings(build_wave(SINE, tcr600), SINE)
    np.testing.assert_allclose(found, np.arange(1, 12) * 1.0, atol=1e-6)


@pytest.mark.parametrize("spacing", CHIRPS)
def test_a_chirp_goes_from_one_frequency_to_the_other(spacing, tcr600):
    found = crossings(build_wave(CHIRPS[spacing], tcr600), CHIRPS[spacing])
    middle, frequency = 0.5 * (found[1:] + found[:-1]), 0.5 / np.diff(found)
    share = middle / 15.0
    wanted = 0.2 + 1.4 * share if spacing == "linear" else 0.2 * 8.0**share
    np.testing.assert_allclose(frequency, wanted, rtol=0.03)


def test_the_wanted_pose_is_that_of_the_model_at_rest_with_the_drives(tcr600):
    wave = build_wave(SINE, tcr600)
    t = np.array([0.0, 2.0, 5.3, 8.1, 12.0])
    for drive, position, normal in zip(wave.drive(t), wave.position(t), wave.normal(t), strict=True):
        q = equilibrium(tcr600.model, drive, tcr600.weight, tcr600.rest.q).q
        np.testing.assert_allclose(position, pose.position(q, tcr600.tip), atol=2e-4)
        np.testing.assert_allclose(normal, pose.normal(q, tcr600.tip), atol=2e-3)


def test_without_a_middle_there_is_no_way_to_it(tcr600):
    settings = SINE.model_copy(update={"middle_mm": ()})
    assert build_wave(settings, tcr600).duration == 1.0 + 12.0 + 1.0
    assert build_wave(SINE, tcr600).duration == 1.0 + 2.0 + 12.0 + 2.0 + 1.0


def test_steps_go_through_all_levels_cable_by_cable_and_back(tcr600):
    steps = StepsSettings(
        kind="steps", levels_mm=(4.0, -2.0), middle_mm=MIDDLE, rise_s=0.5, rest_s=1.0, move_s=2.0
    )
    levels = build_steps(steps, tcr600).corners * 1e3
    np.testing.assert_allclose(levels[[0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(levels[1:-1:3], 15.0)
    for cable in range(3):
        alone = levels[2 + 3 * cable : 5 + 3 * cable] - 15.0
        np.testing.assert_allclose(alone[:, cable], (4.0, -2.0, 0.0), atol=1e-12)
        assert np.abs(np.delete(alone, cable, axis=1)).max() < 1e-12
    together = build_steps(steps.model_copy(update={"cables": "together"}), tcr600).corners * 1e3
    np.testing.assert_allclose(together[2:5], np.outer((19.0, 13.0, 15.0), np.ones(3)))


@pytest.mark.slow
def test_the_speed_of_a_wave_is_seen_by_the_feasibility_check():
    experiment = prepare(load_spec("chirp"))
    peak = 2.0 * np.pi * 1.0 * 8e-3  # about 1 Hz, when it begins to fade
    assert 0.8 * peak < np.abs(plan(experiment).speed).max() < 1.02 * peak
    slow = prepare(load_spec("chirp", ["controller.speed_limit_mm_s=35"]))
    with pytest.raises(InfeasibleError, match="speed of drive"):
        plan(slow)


REFUSED = {
    ("trajectory.to_hz=3",): "trajectory.to_hz: must be at most 2.5, 8 periods of 0.05 s in a cycle, not 3",
    ("trajectory.to_hz=30",): "must be <= 20.0, not 30",
    ("trajectory.amplitude_mm=[1, 2]",): "tcr600 has 3 cables, c1, c2, c3; there are 2 lengths",
    ("trajectory.middle_mm=[1]",): "there are 1 lengths",
    ("trajectory.fade_s=30",): "fade_s must be at most half of the wave's 40 s, not 30",
    ("trajectory.amplitude=[1, 2, 3]",): "did you mean amplitude_mm",
    ("trajectory.spacing=log",): "must be 'linear' or 'exponential', not \"log\"",
}


@pytest.mark.parametrize("settings", REFUSED)
def test_settings_are_strict(settings):
    with pytest.raises(SpecError) as refused:
        load_spec("chirp", settings)
    assert REFUSED[settings] in str(refused.value)
