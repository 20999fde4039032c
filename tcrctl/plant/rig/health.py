"""What the safety supervisor looks at in every cycle, and the limits against which it holds it."""

from __future__ import annotations

from dataclasses import dataclass

from tcrctl.plant.rig.devices import DriveStatus


@dataclass(frozen=True, slots=True)
class Rules:
    """When the supervisor acts.

    Attributes:
        stale: Age of the measurement from which the drives are held [s].
        stale_stop: Age from which they are stopped [s].
        silence: Time without an answer of the drives from which the run is stopped [s].
        rejects: This many refused set-points in a row stop the run.
        following: Largest distance of a drive from its set-point [um].
        standstill: Time in which a controlled stop must end [s].
    """

    stale: float
    stale_stop: float
    silence: float
    rejects: int
    following: int
    standstill: float


@dataclass(frozen=True, slots=True)
class Health:
    """What is known of cameras and drives in one cycle.

    Attributes:
        age: Age of the newest measurement that can be trusted [s].
        status: Last answer of the drives; None if there never was one.
        silence: How long they have not answered [s]; 0 if they just did.
        trouble: What the last failed exchange said; empty if it did not fail.
        following: Largest distance of a drive from its set-point now [um].
        laggard: Name of that cable.
        hopeless: The failed exchange says that waiting cannot help.
        refused: Set-points in a row that the PLC has not taken.
        doubts: Why markers of the last frame could not be used, and how many.
    """

    age: float
    status: DriveStatus | None
    silence: float = 0.0
    trouble: str = ""
    following: int = 0
    laggard: str = ""
    hopeless: bool = False
    refused: int = 0
    doubts: str = ""

    @property
    def enabled(self) -> bool:
        """Whether the drives are on, as far as is known."""
        return self.status is not None and self.status.enabled
