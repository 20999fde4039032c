"""What a dither makes of how much the end surprises, against the formulas written out."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller import surprise
from tcrctl.controller.dither_settings import DitherSettings

PERIOD, LEAST, MOST, THRESHOLD = 0.05, 1e-4, 2e-3, 2e-4
STEPS = 4


def waves(seed):
    rng = np.random.default_rng(seed)
    wave = surprise.still_wave(5e-4, STEPS)
    for values in wave:
        values[:] = 1e-3 * rng.random(values.shape)
    return wave, wave.position + 1e-3 * rng.standard_normal(3)


@pytest.mark.parametrize("seed", range(20))
def test_the_innovation_is_the_mean_error_less_a_part_of_the_mean_motion(seed):
    settings, (wave, position) = DitherSettings(), waves(seed)
    errors, motions, before = wave.errors.copy(), wave.motions.copy(), wave.sizes.copy()
    errors[2], motions[2] = position - wave.expected, wave.expected - wave.position
    size = np.linalg.norm(errors.mean(axis=0)) - settings.motion_part * np.linalg.norm(motions.mean(axis=0))
    size = min(max(size, 0.0), settings.outlier_mm / 1e3)
    innovation = before[1] + (1.0 - np.exp(-PERIOD / settings.filter_s)) * (size - before[1])
    excess = innovation - THRESHOLD
    rate = settings.growth_1_s * excess if excess > 0.0 else -before[0] / settings.release_s
    numbers = surprise.adapting(settings, PERIOD, LEAST, MOST)
    surprise.observe(wave, numbers, position, 2, True, THRESHOLD)
    np.testing.assert_allclose(wave.errors, errors, rtol=1e-14)
    np.testing.assert_allclose(wave.motions, motions, rtol=1e-14)
    np.testing.assert_allclose(wave.sizes[1], innovation, rtol=1e-12)
    np.testing.assert_allclose(wave.sizes[0], np.clip(before[0] + PERIOD * rate, LEAST, MOST), rtol=1e-12)


def test_an_end_that_is_no_number_changes_nothing():
    wave, position = waves(0)
    before = [values.copy() for values in wave]
    position[1] = np.nan
    numbers = surprise.adapting(DitherSettings(), PERIOD, LEAST, MOST)
    surprise.observe(wave, numbers, position, 2, True, THRESHOLD)
    for one, other in zip(wave, before, strict=True):
        assert np.array_equal(one, other)
