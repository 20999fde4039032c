"""What a plant may know of the operation that it takes part in: a run, or work on the bench beside one."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


def unheard(kind: str, level: str, text: str) -> None:
    """Discard an event."""


@dataclass(frozen=True, slots=True)
class Operation:
    """A run, or work beside one, as a plant sees it.

    Attributes:
        time: Time of the run's steps [s]; 0 before the first one is due.
        report: Takes kind, level and text of an event; never raises.
        confirmed: The operator has agreed that the robot moves.
    """

    time: Callable[[], float] = time.monotonic
    report: Callable[[str, str, str], None] = unheard
    confirmed: bool = False
