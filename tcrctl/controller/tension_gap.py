"""What a prediction leaves out of the difference between estimated tensions and the model's.

A millimetre of length error is 1.5 N, so tensions read off marker positions are wrong by newtons for ever, and a
controller that believes them winds in or pays out. And they jump by newtons when a marker is lost: a controller
that takes this for a cable about to go slack throws the end to save it. Only what lies between is believed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from tcrctl.controller.prediction_settings import TensionGapSettings
from tcrctl.memory import TENSION, Kept
from tcrctl.numerics.kernel import kernel
from tcrctl.signals import Array


class TensionGap:
    """Two filters that begin at the first difference that they are told."""

    def __init__(self, settings: TensionGapSettings | None, period: float, cables: int) -> None:
        """Take a ``tension_gap:`` section, or None for none, the control period [s] and the number of cables."""
        self._blend = 0.0 if settings is None else _part(period, settings.filter_s)
        self._quick = 1.0 if settings is None else _part(period, settings.smooth_s)
        self._lasting, self._smooth, self._begun = np.zeros(cables), np.zeros(cables), False

    def memory(self) -> Mapping[str, Kept]:
        """Return the lasting difference and the smooth one, if there are such filters."""
        found = {} if self._blend == 0.0 else {"tension_gap": Kept(self._lasting, TENSION)}
        return {**found, **({} if self._quick == 1.0 else {"tension_smooth": Kept(self._smooth, TENSION)})}

    def left_out(self, gap: Array) -> Array:
        """Return what lasts of the difference and what is noise, zero if that is off (m,) [N].

        Args:
            gap: Estimated tensions minus those of the model at rest (m,) [N]; passed over if it is no number.
        """
        if self._blend == 0.0 or not math.isfinite(gap.sum()):
            return self._lasting
        if not self._begun:
            self._lasting[:], self._smooth[:], self._begun = gap, gap, True
        left: Array = _left_out(self._lasting, self._smooth, gap, self._blend, self._quick)
        return left


@kernel(error_model="numpy")
def _left_out(lasting: Array, smooth: Array, gap: Array, blend: float, quick: float) -> Array:
    """Move both filters (m,) [N] on by their parts of the way; return what lasts and what is noise (m,) [N]."""
    left = np.empty(gap.shape[0])
    for c in range(gap.shape[0]):
        lasting[c] += blend * (gap[c] - lasting[c])
        smooth[c] += quick * (gap[c] - smooth[c])
        left[c] = lasting[c] + (gap[c] - smooth[c])
    return left


def _part(period: float, time: float) -> float:
    """Return the part of the way that a filter goes in a period; all of it without a time constant."""
    return 1.0 if time == 0.0 else -float(np.expm1(-period / time))
