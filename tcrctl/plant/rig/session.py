"""What a plant may know of the run that it takes part in."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


def unheard(kind: str, level: str, text: str) -> None:
    """Take an event and drop it."""


@dataclass(frozen=True, slots=True)
class Session:
    """The run as a plant sees it.

    Attributes:
        time: Time of the run's steps [s]; 0 before the first one is due.
        report: Takes kind, level and text of an event; never raises.
        confirmed: The operator has agreed that the robot moves.
    """

    time: Callable[[], float] = time.monotonic
    report: Callable[[str, str, str], None] = unheard
    confirmed: bool = False
