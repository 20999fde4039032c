"""What is asked of a replay, and what it found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.errors import InputError
from tcrctl.experiment.headline import number
from tcrctl.log.comparison import Deviation, Difference
from tcrctl.replay.environment import Change


@dataclass(frozen=True, slots=True)
class Window:
    """Steps that are compared, both ends included; the replay itself always begins at step 0."""

    first: int = 0
    last: int | None = None

    def __contains__(self, k: int) -> bool:
        """Tell whether step ``k`` is compared."""
        return self.first <= k and (self.last is None or k <= self.last)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Differences that count as none: ``atol`` in the unit of each quantity plus ``rtol`` times its value."""

    atol: float = 0.0
    rtol: float = 0.0


#: Every step is compared.
ALL_STEPS: Final = Window()
#: By bytes.
EXACT: Final = Tolerance()


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay found.

    Attributes:
        log: The log.
        status: ``identical``; ``different``; ``incomplete``: no difference, but the log has a gap or no end.
        reason: What differs or is missing; empty if identical.
        steps: Steps that were replayed.
        compared: Steps that were compared with what was recorded.
        different: Steps of these that differ.
        whole: Every step that should have been compared was.
        first_difference: The first number that differs.
        deviations: Every quantity that differs, in order of appearance.
        environment: Versions and hardware that differ.
        not_compared: What could not be compared, and why.
        duration_s: Time that the replayed steps took when they were recorded [s].
        seconds: Time that replaying them took [s].
        out: Log of the replayed steps, if one was asked for.
    """

    log: Path
    status: str
    reason: str
    steps: int
    compared: int
    different: int
    whole: bool
    first_difference: Difference | None
    deviations: tuple[Deviation, ...]
    environment: tuple[Change, ...]
    not_compared: tuple[str, ...]
    duration_s: float
    seconds: float
    out: Path | None

    @property
    def exit_code(self) -> int:
        """0 if all that the log holds was replayed and is the same, else 3."""
        return 0 if self.whole and self.first_difference is None else 3

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``replay --json``."""
        return {
            "status": self.status,
            "reason": self.reason,
            "log": str(self.log),
            "steps": self.steps,
            "compared": self.compared,
            "different": self.different,
            "first_difference": None if self.first_difference is None else self.first_difference.as_json(),
            "deviations": [deviation.as_json() for deviation in self.deviations],
            "environment": [
                {"name": change.name, "recorded": change.recorded, "now": change.now}
                for change in self.environment
            ],
            "not_compared": list(self.not_compared),
            "duration_s": self.duration_s,
            "seconds": self.seconds,
            "out": None if self.out is None else str(self.out),
        }


def what_if(deviations: Mapping[str, Deviation]) -> str:
    """Say what other settings would have commanded, given the same input.

    Args:
        deviations: What differs, by path; at least one quantity.
    """
    speed = deviations.get("wanted.speed")
    if speed is None:
        other = next(iter(deviations.values()))
        return f"the command would be the same; {other.field} would differ from step {other.first_step} on"
    most = number(1e3 * speed.largest, "mm/s")
    return f"the command would differ from step {speed.first_step} on by at most {most}"


def checked_window(first: int | None, last: int | None) -> Window:
    """Make a window of two step indices as given on the command line.

    Raises:
        InputError: If it is empty.
    """
    if last is not None and last < (first or 0):
        raise InputError(f"--to {last} is before --from {first or 0}: no step would be compared")
    return Window(first or 0, last)
