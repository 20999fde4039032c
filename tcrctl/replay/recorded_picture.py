"""The judgement of the cameras' picture in a replay: what was recorded is what was left of it."""

from __future__ import annotations

from tcrctl.loop.loop import HELD
from tcrctl.plant.recorded import Recorded
from tcrctl.signals import Measurement


class RecordedPicture:
    """Holds the drives in the steps in which they were held.

    Attributes:
        doubt: Why they were in this step; empty if they were not.
    """

    def __init__(self, plant: Recorded) -> None:
        """Take the recording, which has moved on to a step before that step is judged."""
        self._plant, self.doubt = plant, ""

    def judged(self, measured: Measurement, elapsed: float) -> Measurement:
        """Return what was recorded."""
        del elapsed  # how long it took to run is in the record
        reason = self._plant.step.info.reason
        self.doubt = reason.removeprefix(HELD) if reason.startswith(HELD) else ""
        return measured

    def broken(self, step: int) -> None:
        """Stop nothing: the recording ends where the run was stopped."""
