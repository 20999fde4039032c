"""``plant.realistic``: what is drawn, what wins over it, and that a drawn plant can be written down."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.plant.realistic import LEVELS, as_drawn
from tcrctl.plant.reality_settings import DRAWN
from tcrctl.plant.settings import SimulatedSettings

SEEDS = range(40)


def plant(**settings):
    return SimulatedSettings(kind="simulated", **settings)


def drawn(level="moderate", seed=1, **settings):
    return as_drawn(plant(realistic=level, **settings), 6, seed)


def test_off_draws_nothing():
    settings = plant(noise_um=50.0)
    assert as_drawn(settings, 6, 1) is settings


@pytest.mark.parametrize("level", LEVELS)
def test_a_level_draws_every_section(level):
    settings = drawn(level)
    for name in DRAWN:
        assert getattr(plant(), name) is None
        assert getattr(settings, name) is not None
    assert settings.realistic == level
    assert settings.mismatch is None
    assert (settings.noise_um, settings.latency_ms) == (0.0, 0.0)


def test_moderate_is_what_the_documentation_says():
    many = [drawn(seed=seed) for seed in SEEDS]
    one = many[0]
    assert (one.friction.coefficient, one.friction.least_wrap_deg) == (0.1, 2.0)
    assert (one.drives.lag_s, one.drives.dead_time_s, one.drives.backlash_mm) == (0.03, 0.0, 0.2)
    assert one.drives.reports == "encoder"
    assert (one.scatter.springs, one.scatter.masses) == (0.1, 0.05)
    assert (one.scatter.geometry_mm, one.scatter.holes_deg, one.scatter.tilt_deg) == (0.5, 1.0, 0.25)
    assert (one.cameras.lost_markers, one.cameras.lost_frames, one.cameras.age_jitter_ms) == (0.05, 0.01, 3.0)
    assert one.cameras.marker_bias_mm == 1.0
    assert (one.cameras.frame_error.rotation_deg, one.cameras.frame_error.translation_mm) == (0.25, 0.5)
    assert one.cables.creep[0].strength == 0.1
    assert one.springs_hysteresis.share == 0.05
    assert {d.cables.initial_tension for d in many} == {0.85, 1.15}
    zeros = np.array([d.drives.zero_error_mm for d in many])
    radii = np.array([d.drives.radius_error for d in many])
    assert zeros.std() == pytest.approx(1.0, rel=0.2)
    assert radii.std() == pytest.approx(0.01, rel=0.2)
    assert np.abs(zeros).max() <= 2.0


def test_mild_is_half_of_moderate_and_severe_at_least_its_scatter():
    mild, moderate, severe = (LEVELS[name] for name in ("mild", "moderate", "severe"))
    for name in moderate.__slots__:
        low, mid, high = (np.max(getattr(sizes, name)) for sizes in (mild, moderate, severe))
        assert low == pytest.approx(mid / 2.0), name
        assert high >= mid, name
    assert {round(drawn("severe", seed).friction.coefficient, 3) for seed in SEEDS} != {0.2}
    assert all(0.2 <= drawn("severe", seed).friction.coefficient <= 0.3 for seed in SEEDS)


def test_what_is_given_wins_also_when_it_is_off():
    settings = drawn(friction=None, drives={"lag_s": 0.2})
    assert settings.friction is None
    assert settings.drives.lag_s == 0.2
    assert settings.drives.backlash_mm == 0.0
    assert settings.cameras == drawn().cameras


def test_a_draw_depends_on_its_seed_alone():
    assert drawn(seed=3) == drawn(seed=3)
    assert drawn(seed=3).drives != drawn(seed=4).drives
    assert drawn(seed=3, realistic_seed=7) == drawn(seed=4, realistic_seed=7)
    assert drawn(seed=7).drives == drawn(seed=4, realistic_seed=7).drives
    assert drawn(seed=3).scatter.seed != drawn(seed=4).scatter.seed


def test_written_down_and_read_again_it_is_the_same_plant_for_any_seed_of_the_run():
    settings = drawn(seed=3)
    again = SimulatedSettings.model_validate_json(settings.model_dump_json())
    assert as_drawn(again, 6, 99) == settings
