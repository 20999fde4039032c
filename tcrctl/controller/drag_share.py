"""Learns how much of the drag that usual friction would give the holes of this robot have.

Without drag a robot would come to rest at r = δ + K^-1 M (a + α v), whatever its speed. With it r moves with the
speed, r = Δ + κ h, h = K^-1 f, f the drag of usual friction (robot.hole_drag) in a robot that follows its drives at
once. So κ is the regression of r on h at the end, both without what lasts (the offset Δ), over the last seconds:

    κ = Σ h'r / (Σ h'h + s²),    0 <= κ <= κ_max,  sums fade with a time constant

The dither itself is filtered out of both. A robot without friction is found to have none; s keeps κ at 0 until the
motion has told enough.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array

#: Time constant of the filter that takes the dither out [s], and of what lasts [s].
QUICK_S: Final = 0.2
SLOW_S: Final = 1.0
#: Time constant with which the past is forgotten [s].
FORGET_S: Final = 10.0
#: s² is so much, for a second [m2].
DOUBT: Final = 5e-7
#: κ_max: three times usual friction.
MOST: Final = 3.0


class Learning(NamedTuple):
    """Numbers of the regression.

    Attributes:
        quick: Part that r and h without the dither go towards r and h in one step.
        slow: Part that what lasts goes towards them.
        fade: Part of the sums that is forgotten in one step.
        doubt: s² [m2].
        most: κ_max.
    """

    quick: float
    slow: float
    fade: float
    doubt: float
    most: float


class DragShare(NamedTuple):
    """What is known of the drag, changed in place.

    Attributes:
        share: κ (1,).
        sums: Σ h'r and Σ h'h (2,) [m2].
        smooth: r and h without the dither (2, 3) [m].
        lasting: What lasts of them (2, 3) [m].
    """

    share: Array
    sums: Array
    smooth: Array
    lasting: Array


def learning(period: float) -> Learning:
    """Return the numbers for a control period [s]."""
    quick, slow, fade = (-float(np.expm1(-period / time)) for time in (QUICK_S, SLOW_S, FORGET_S))
    return Learning(quick, slow, fade, DOUBT / period, MOST)


def nothing_known() -> DragShare:
    """Return the beginning: no drag."""
    return DragShare(np.zeros(1), np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3)))


@part(error_model="numpy")
def forget(known: DragShare, numbers: Learning) -> None:
    """Let what was told fade by one step; what is left says κ."""
    known.sums[0] *= 1.0 - numbers.fade
    known.sums[1] *= 1.0 - numbers.fade
    found = known.sums[0] / (known.sums[1] + numbers.doubt)
    known.share[0] = min(max(found, 0.0), numbers.most)


@part(error_model="numpy")
def learn(known: DragShare, numbers: Learning, r: Array, h: Array) -> None:
    """Take r and h of one step at the end (3,) [m]."""
    for i in range(3):
        known.smooth[0, i] += numbers.quick * (r[i] - known.smooth[0, i])
        known.smooth[1, i] += numbers.quick * (h[i] - known.smooth[1, i])
        for j in range(2):
            known.lasting[j, i] += numbers.slow * (known.smooth[j, i] - known.lasting[j, i])
        a = known.smooth[0, i] - known.lasting[0, i]
        b = known.smooth[1, i] - known.lasting[1, i]
        known.sums[0] += a * b
        known.sums[1] += b * b
    forget(known, numbers)
