"""Learns how much more, or less, the robot moves with its drives than the model, once it rests.

The offset Δ (controller.multi_step) is where the robot comes to rest, minus where the model does. On a robot with
other springs, weights, tensions and holes it is no constant: it goes with the drives d by several times what the
model itself moves, and a filter that waits for it lags behind every stroke. So Δ is followed by a Kalman filter
[K60] that knows its derivative, the gain G = ∂Δ/∂d (n_free, m), as far as the motion has told it:

    Δ <- Δ + G Δd + noise q,     G <- (1 - λ) G + noise,     measured: p = Δ + noise r

p is the point that the robot vibrates about, d the drives without the dither. All coordinates are told by the same
motion, so they share one covariance P (1 + m, 1 + m), in units of r². q is chosen so that a robot that rests is
filtered with the time constant of the offset; λ lets G fade where nothing is told of it, and keeps P bounded.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tcrctl.controller.prediction_settings import RestGainSettings
from tcrctl.numerics.copies import copy_vector, scale_rows
from tcrctl.numerics.kernel import part
from tcrctl.robot.module import FIXED, RING
from tcrctl.signals import Array


class GainLearning(NamedTuple):
    """Numbers of the filter.

    Attributes:
        drift: Variance by which Δ goes astray in one step, in units of r².
        fade: λ, part of G that is forgotten in one step.
        doubt: Variance of a component of G of which nothing is known, in units of r² [1/m2]; 0 learns nothing.
        most: Largest displacement of the end by one drive that is believed [m/m].
    """

    drift: float = 0.0
    fade: float = 0.0
    doubt: float = 0.0
    most: float = 0.0


class RestGain(NamedTuple):
    """What is known, changed in place.

    Attributes:
        gain: G (n_free, m).
        drive: Drives of the last step, without dither (m,) [m].
        moved: By what G has moved the end since the beginning (3,) [m].
        covariance: P (1 + m, 1 + m).
    """

    gain: Array
    drive: Array
    moved: Array
    covariance: Array


def no_gain(n_free: int, m: int) -> RestGain:
    """Return the beginning: the robot is as its model."""
    return RestGain(np.zeros((n_free, m)), np.zeros(m), np.zeros(3), np.zeros((1 + m, 1 + m)))


def gain_learning(settings: RestGainSettings | None, blend: float, period: float) -> GainLearning:
    """Return the numbers of a filter.

    Args:
        settings: Of what is learnt; None learns nothing.
        blend: Part of the way that Δ goes in one step of a robot that rests.
        period: Control period [s].
    """
    if settings is None or not 0.0 < blend < 1.0:
        return GainLearning()
    fade = -math.expm1(-period / settings.forget_s)
    doubt = 1e3 * settings.doubt / settings.noise_mm
    return GainLearning(blend * blend / (1.0 - blend), fade, doubt * doubt, settings.most)


@part(error_model="numpy")
def rest(known: RestGain, numbers: GainLearning, drive: Array, blend: float) -> None:
    """Begin where the robot rests at a drive (m,) [m]: nothing is known of G, and Δ as well as ever."""
    m = drive.shape[0]
    copy_vector(drive, known.drive)
    known.covariance[:] = 0.0
    known.covariance[0, 0] = blend
    for c in range(1, m + 1):
        known.covariance[c, c] = numbers.doubt


@part(error_model="numpy")
def carry(known: RestGain, numbers: GainLearning, drive: Array, offset: Array, tip: int) -> None:
    """Move Δ (3 n_nodes,) [m] on to the drives of a step (m,) [m], and say so in P."""
    m, P = drive.shape[0], known.covariance
    moved = drive - known.drive
    for k in range(known.gain.shape[0]):
        change = 0.0
        for c in range(m):
            change += known.gain[k, c] * moved[c]
        offset[3 * FIXED + k] += change
    end = _end_gain(known.gain, tip)
    for i in range(3):
        for c in range(m):
            known.moved[i] += end[i, c] * moved[c]
    across = np.zeros(m)
    for c in range(m):
        for j in range(m):
            across[c] += P[1 + c, 1 + j] * moved[j]
    for c in range(m):
        P[0, 0] += moved[c] * (2.0 * P[0, 1 + c] + across[c])
    P[0, 0] += numbers.drift
    for c in range(m):
        P[0, 1 + c] += across[c]
        P[1 + c, 0] = P[0, 1 + c]
    copy_vector(drive, known.drive)
    _fade(known, numbers)


@part(error_model="numpy")
def _fade(known: RestGain, numbers: GainLearning) -> None:
    """Forget a part of G: P goes towards that of nothing known."""
    left, P = 1.0 - numbers.fade, known.covariance
    scale_rows(known.gain, left)
    for c in range(1, P.shape[0]):
        P[0, c] *= left
        P[c, 0] *= left
        for j in range(1, P.shape[0]):
            P[c, j] *= left * left
        P[c, c] += (1.0 - left * left) * numbers.doubt


@part(error_model="numpy")
def tell(known: RestGain, numbers: GainLearning, found: Array, offset: Array, tip: int) -> None:
    """Take the point that the robot vibrates about, found (n_free,) [m] from the model's equilibrium.

    Args:
        known: Changed.
        numbers: Of the filter.
        found: p (n_free,) [m].
        offset: Δ (3 n_nodes,) [m], changed.
        tip: Row of the first node of the tip ring.
    """
    P, size = known.covariance, known.covariance.shape[0]
    scale = P[0, 0] + 1.0
    part = P[0] / scale
    for k in range(found.shape[0]):
        missed = found[k] - offset[3 * FIXED + k]
        offset[3 * FIXED + k] += part[0] * missed
        for c in range(1, size):
            known.gain[k, c - 1] += part[c] * missed
    for i in range(size):
        for j in range(size):
            P[i, j] -= scale * part[i] * part[j]
    _bound(known, numbers, tip)


@part(error_model="numpy")
def _end_gain(gain: Array, tip: int) -> Array:
    """Return by what G (n_free, m) moves the centre of the tip ring (3, m)."""
    end = np.zeros((3, gain.shape[1]))
    for node in range(tip - FIXED, tip - FIXED + RING):
        for i in range(3):
            for c in range(gain.shape[1]):
                end[i, c] += gain[3 * node + i, c] / RING
    return end


@part(error_model="numpy")
def _bound(known: RestGain, numbers: GainLearning, tip: int) -> None:
    """Scale G so that no drive moves the end by more than is believed."""
    end = _end_gain(known.gain, tip)
    for c in range(end.shape[1]):
        size = math.sqrt(end[0, c] ** 2 + end[1, c] ** 2 + end[2, c] ** 2)
        if size > numbers.most:
            for k in range(known.gain.shape[0]):
                known.gain[k, c] *= numbers.most / size
