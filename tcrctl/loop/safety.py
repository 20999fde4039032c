"""When a run must stop: checked in every step, before the command is sent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from tcrctl.errors import SafetyLimitError
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """What a step must keep for the run to go on.

    Attributes:
        position_error: Largest distance between estimated and wanted end position [m].
        tension: Largest cable tension [N].
        unsolved: This many steps in a row without a solution of controller or estimator stop the run.
    """

    position_error: float
    tension: float
    unsolved: int = 2


#: Stops nothing but commands that are no numbers.
NO_LIMITS: Final = SafetyLimits(np.inf, np.inf, 2**62)


class SafetyGuard:
    """Watches the steps of one run."""

    def __init__(self, limits: SafetyLimits = NO_LIMITS) -> None:
        self._limits, self._unsolved = limits, 0

    def check(
        self, step: int, reference: Reference, estimate: Estimate, wanted: Command, info: ControlInfo
    ) -> SafetyLimitError | None:
        """Return why the command of a step must not be sent and the run has to stop; None if all is well.

        Args:
            step: Index of the step.
            reference: What is wanted.
            estimate: Where the robot is.
            wanted: What the controller wants to send.
            info: How it came to that.
        """
        limits = self._limits
        self._unsolved = 0 if info.converged and estimate.converged else self._unsolved + 1
        error = float(np.linalg.norm(estimate.position - reference.position))
        tension = _highest(estimate.tension)
        wrong = int(np.count_nonzero(~np.isfinite(np.concatenate((wanted.speed, wanted.drive)))))
        if wrong:
            return SafetyLimitError(step, "number of commands that are no finite numbers", wrong, 0, "")
        if not error <= limits.position_error:
            return SafetyLimitError(
                step, "estimated position error", 1e3 * error, 1e3 * limits.position_error, "mm"
            )
        if not tension <= limits.tension:
            return SafetyLimitError(step, "estimated cable tension", tension, limits.tension, "N")
        if self._unsolved >= limits.unsolved:
            why = info.reason or ("the estimator failed" if info.converged else "the controller failed")
            what = f"number of steps in a row without a solution ({why})"
            return SafetyLimitError(step, what, self._unsolved, limits.unsolved - 1, "")
        return None


def _highest(values: Array) -> float:
    """Return the largest value, NaN if one of them is."""
    return float(np.max(values, initial=-np.inf))
