"""What the loop asks of whoever judges the cameras' picture."""

from __future__ import annotations

from typing import Protocol

from tcrctl.errors import PictureError
from tcrctl.signals import Measurement


class Picture(Protocol):
    """Judges one frame after the other.

    Attributes:
        doubt: Why the drives must be held in this step; empty if they need not.
    """

    doubt: str

    def judged(self, measured: Measurement, elapsed: float) -> Measurement:
        """Return the frame of this step without the markers that are not believed.

        Args:
            measured: The frame.
            elapsed: Time since the first step of the run, missed steps counted [s].
        """
        ...

    def broken(self, step: int) -> PictureError | None:
        """Return why the run must stop in this step; None if it need not."""
        ...


class Unjudged:
    """Believes every picture."""

    doubt = ""

    def judged(self, measured: Measurement, elapsed: float) -> Measurement:
        """Return the frame."""
        del elapsed
        return measured

    def broken(self, step: int) -> None:
        """Stop nothing."""
