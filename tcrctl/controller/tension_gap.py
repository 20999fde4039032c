"""The lasting difference between estimated tensions and the model's, which a prediction leaves out.

A millimetre of length error is 1.5 N, so tensions read off marker positions are wrong by newtons for ever, and a
controller that believes them winds in or pays out. Only what changes faster than the filter is believed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.prediction_settings import TensionGapSettings
from tcrctl.memory import TENSION, Kept
from tcrctl.signals import Array


class TensionGap:
    """A filter that begins at the first difference that it is told."""

    def __init__(self, settings: TensionGapSettings | None, period: float, cables: int) -> None:
        """Take a ``tension_gap:`` section, or None for none, the control period [s] and the number of cables."""
        self._blend = 0.0 if settings is None else -float(np.expm1(-period / settings.filter_s))
        self._lasting, self._begun = np.zeros(cables), False

    def memory(self) -> Mapping[str, Kept]:
        """Return the lasting difference, if there is a filter."""
        return {} if self._blend == 0.0 else {"tension_gap": Kept(self._lasting, TENSION)}

    def lasting(self, gap: Array) -> Array:
        """Return what lasts of the difference, zero if that is off (m,) [N].

        Args:
            gap: Estimated tensions minus those of the model at rest (m,) [N]; passed over if it is no number.
        """
        if self._blend > 0.0 and np.isfinite(gap).all():
            if not self._begun:
                self._lasting[:], self._begun = gap, True
            self._lasting += self._blend * (gap - self._lasting)
        return self._lasting
