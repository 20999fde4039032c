"""How much the end of a dithered robot surprises, and what that makes of the dither's amplitude.

    innovation <- filtered | mean over a wave of (measured - expected) | - part * | mean of (expected - last) |
    amplitude grows by the innovation beyond a threshold, and else fades

See ``dither`` for why.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tcrctl.controller.dither_settings import DitherSettings
from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array


class Wave(NamedTuple):
    """What has happened in the last wave, changed in place.

    Attributes:
        sizes: Amplitude, and filtered size of the innovation (2,) [m].
        expected: End position that was expected for now (3,) [m].
        position: End position a period before (3,) [m].
        errors: Measured minus expected end positions, a ring buffer (steps of a wave, 3) [m].
        motions: Expected motions of the end, the same (steps of a wave, 3) [m].
    """

    sizes: Array
    expected: Array
    position: Array
    errors: Array
    motions: Array


class Adapting(NamedTuple):
    """Numbers of the adaptation.

    Attributes:
        blend: Part of the way that the innovation's size goes in a period.
        motion_part: Part of the motion expected by which a model without friction is wrong, too.
        outlier: Largest innovation that counts [m].
        growth: Way that the amplitude grows in a period, per innovation beyond the threshold.
        decay: Part of the amplitude that fades in a period.
        least, most: Bounds of the amplitude [m].
    """

    blend: float
    motion_part: float
    outlier: float
    growth: float
    decay: float
    least: float
    most: float


def adapting(settings: DitherSettings, period: float, least: float, most: float) -> Adapting:
    """Return the numbers for a control period [s] and bounds of the amplitude [m]."""
    return Adapting(
        blend=-float(np.expm1(-period / settings.filter_s)),
        motion_part=settings.motion_part,
        outlier=settings.outlier_mm / 1e3,
        growth=period * settings.growth_1_s,
        decay=period / settings.release_s,
        least=least,
        most=most,
    )


def still_wave(amplitude: float, steps: int) -> Wave:
    """Return the beginning of a dither with so many steps a wave."""
    return Wave(
        np.array([amplitude, 0.0]), np.zeros(3), np.zeros(3), np.zeros((steps, 3)), np.zeros((steps, 3))
    )


@part(error_model="numpy")
def _mean_size(rows: Array) -> float:
    """Return the length of the mean of rows (n, 3)."""
    square = 0.0
    for i in range(3):
        total = 0.0
        for n in range(rows.shape[0]):
            total += rows[n, i]
        square += (total / rows.shape[0]) ** 2
    return math.sqrt(square)


@part(error_model="numpy")
def compare(wave: Wave, numbers: Adapting, position: Array, slot: int) -> None:
    """Put the end position now (3,) [m] into a row of the buffers, and filter the innovation."""
    for i in range(3):
        wave.errors[slot, i] = position[i] - wave.expected[i]
        wave.motions[slot, i] = wave.expected[i] - wave.position[i]
    size = max(_mean_size(wave.errors) - numbers.motion_part * _mean_size(wave.motions), 0.0)
    wave.sizes[1] += numbers.blend * (min(size, numbers.outlier) - wave.sizes[1])


@kernel(error_model="numpy")
def observe(
    wave: Wave, numbers: Adapting, position: Array, slot: int, expects: bool, threshold: float
) -> None:
    """Take the end position of a step, if it is one, and adapt the amplitude.

    Args:
        wave: Changed.
        numbers: Of the adaptation.
        position: Measured end position now (3,) [m].
        slot: Row of the buffers.
        expects: There is an expected position.
        threshold: Innovation that is not friction [m].
    """
    if np.isfinite(position[0] + position[1] + position[2]):
        if expects:
            compare(wave, numbers, position, slot)
        amplitude, excess = wave.sizes[0], wave.sizes[1] - threshold
        grown = amplitude + (numbers.growth * excess if excess > 0.0 else -numbers.decay * amplitude)
        wave.sizes[0] = min(max(grown, numbers.least), numbers.most)
