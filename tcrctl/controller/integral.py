"""Integral action: the target is shifted by the integrated end pose error, so that no error lasts."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from tcrctl.controller.settings import IntegralSettings
from tcrctl.memory import NORMAL, POSITION, Kept
from tcrctl.signals import Array


class IntegralAction:
    """Shift of the target position (3) [m] and normal (3), bounded, and frozen while inputs are saturated.

    Attributes:
        shift: The present shift (6,): position [m], normal.
    """

    def __init__(self, settings: IntegralSettings | None, period: float) -> None:
        self.shift = np.zeros(6)
        self._rate = 0.0 if settings is None else settings.gain_1_s * period
        mm, deg = (0.0, 0.0) if settings is None else (settings.limit_mm, settings.limit_deg)
        self._limit = np.repeat([mm / 1000.0, math.radians(deg)], 3)

    def memory(self, normal: Array | None) -> Mapping[str, Kept]:
        """Return the shift of the position, and of the ``normal`` (3,) if that is tracked; 0 while it is off."""
        if self._rate == 0.0:
            return {}
        position = {"integral_position": Kept(self.shift[:3], POSITION)}
        if normal is None:
            return position
        return {**position, "integral_normal": Kept(self.shift[3:], NORMAL, blind=normal)}

    def update(self, error: Array, saturated: bool, gain: float = 1.0) -> Array:
        """Add one period of ``error`` (6,) = wanted - measured, with a part of the gain; returns the shift.

        Saturated inputs cannot act on more shift (anti-windup), so it does not grow then.
        """
        wanted: Array = np.minimum(
            np.maximum(self.shift + gain * self._rate * error, -self._limit), self._limit
        )
        if saturated:
            wanted = np.where(np.abs(wanted) < np.abs(self.shift), wanted, self.shift)
        self.shift = wanted
        return wanted
