"""Something that happened at an instant: a phase change, a limit trip, an operator's action."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

LEVELS: Final = {"debug": 1, "info": 2, "warning": 3, "error": 4, "fatal": 5}
"""Level names and the numbers foxglove.Log gives them."""


@dataclass(frozen=True, slots=True)
class Event:
    """One event of a run.

    Attributes:
        t: Time on the clock of the steps [s].
        kind: Short machine-readable name, for instance ``limit`` or ``phase``.
        level: One of ``LEVELS``.
        message: What happened, for a person.

    Raises:
        ValueError: If the level is not one of ``LEVELS``.
    """

    t: float
    kind: str
    level: str
    message: str

    def __post_init__(self) -> None:
        if self.level not in LEVELS:
            raise ValueError(f"event level {self.level!r} is not one of {', '.join(LEVELS)}")
