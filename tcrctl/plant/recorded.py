"""A log that behaves as a plant, and as the trajectory that was wanted: what a controller is replayed against.

Whatever is commanded, the next measurement is the recorded one. So a replay tells exactly what the estimator and
the controller do with the same input, and nothing about what the robot would have done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from tcrctl.errors import InputError, TcrctlError
from tcrctl.signals import Array, Command, Measurement, StepRecord, Truth

Limits = Callable[[Command, Array], Command]
"""What a plant makes of a command that it gets while its drives shall be at some lengths (m,) [m]."""


class RecordingEndedError(TcrctlError):
    """There is no further step to be replayed.

    Attributes:
        next_k: Index of the step that was asked for.
        found: Index of the step that the log has instead; None at its end.
    """

    def __init__(self, next_k: int, found: int | None) -> None:
        missing = (
            f"step {next_k} is missing" if found == next_k + 1 else f"steps from {next_k} on are missing"
        )
        super().__init__("the log has no further step" if found is None else missing)
        self.next_k, self.found = next_k, found


class Recorded:
    """Steps of a log, one after the other; :meth:`read` moves on to the next.

    Attributes:
        duration: A recorded trajectory ends where the recording ends (infinity) [s].
        step: The present step.
        limited: What the recorded plant would have made of the command written last; None if its limits are
            not known.
    """

    duration = float("inf")
    step: StepRecord
    limited: Command | None

    def __init__(
        self, steps: Iterator[StepRecord], limits: Limits | None, *, reports_set_points: bool = True
    ) -> None:
        """Take the steps of a log.

        Args:
            steps: From the first one on.
            limits: Those of the plant that was recorded if they are known.
            reports_set_points: Its drives were measured to be where they should be.
        """
        self._steps = steps
        self._limits = limits
        self._next_k = 0
        self.limited = None
        self._reports_set_points = reports_set_points
        self._set_point: Array | None = None

    def read(self) -> Measurement:
        """Move on to the next step and return what was measured.

        Raises:
            RecordingEndedError: If there is none, or one is missing; what comes after a gap cannot be replayed,
                because the state of estimator and controller there is not known.
        """
        step = next(self._steps, None)
        if step is None or step.k != self._next_k:
            raise RecordingEndedError(self._next_k, None if step is None else step.k)
        measured = self._next_k == 0 or self._reports_set_points
        self._set_point = step.measurement.drive if measured else self.step.applied.drive
        self.step, self._next_k = step, self._next_k + 1
        return step.measurement

    def truth(self) -> Truth | None:
        """Return what a simulated plant knew about itself."""
        return self.step.truth

    def write(self, command: Command) -> Command:
        """Return what was applied at that time; what would have been is in ``limited``."""
        if self._limits is not None and self._set_point is not None:
            self.limited = self._limits(command, self._set_point)
        return self.step.applied

    def close(self) -> None:
        """Do nothing: there is nothing to leave safe."""

    def state(self) -> tuple[Array, Array]:
        """Return the state (q, v) that an estimator of kind ``exact`` was given.

        Raises:
            InputError: If the log holds the full state of some steps only.
        """
        estimate = self.step.estimate
        if not estimate.q.size:
            raise InputError(
                f"estimator.kind: exact needs the full state in every step; step {self.step.k} has none",
                hint="Such a run is recorded with log.full_state_s=0.",
            )
        return estimate.q.copy(), estimate.v.copy()

    def position(self, t: Array) -> Array:
        """Return recorded end positions wanted now and at the prediction instants ``t`` (n,) [s], (n, 3) [m]."""
        reference = self.step.reference
        return self._as_asked(t, np.vstack([reference.position, reference.ahead_position]))

    def normal(self, t: Array) -> Array | None:
        """Return recorded end normals wanted now and at the prediction instants (n, 3), or None."""
        reference = self.step.reference
        if reference.normal is None or reference.ahead_normal is None:
            return None
        return self._as_asked(t, np.vstack([reference.normal, reference.ahead_normal]))

    def drive(self, t: Array) -> Array | None:
        """Return recorded drive lengths wanted at the first prediction instant (1, m) [m], or None."""
        drive = self.step.reference.drive
        return None if drive is None else self._as_asked(t, drive[None])

    def _as_asked(self, t: Array, values: Array) -> Array:
        if len(t) != len(values):
            raise InputError(
                f"step {self.step.k} of the log has a reference at {len(values)} instants, not at {len(t)}"
            )
        return values
