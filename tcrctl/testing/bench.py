"""What a conformance suite needs to know of a device, and what it may do to it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from tcrctl.plant.rig.devices import Cameras, Drives

Hook = Callable[[bool], None]
"""Makes something go wrong (True), and right again (False)."""


@dataclass(frozen=True, slots=True)
class CameraBench:
    """Cameras that see the markers of a robot that hangs still.

    Attributes:
        open: Builds the cameras and connects.
        size: Rows of ``Sighting.nodes``.
        mapped: How many of them carry a marker; all if None.
        latency: Largest age of a frame when it arrives [s].
        slack: How much later than its ``timeout`` a call may end [s].
        silence: No frames are sent.
        freeze: The same frame is sent again and again.
        hide: Some markers, not all, are hidden.
        clock: That of ``Sighting.taken`` [s].
        sleep: Waits for a time [s].
    """

    open: Callable[[], Cameras]
    size: int
    mapped: int | None = None
    latency: float = 0.05
    slack: float = 0.1
    silence: Hook | None = None
    freeze: Hook | None = None
    hide: Hook | None = None
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep

    @property
    def markers(self) -> int:
        """Number of nodes that carry a marker."""
        return self.size if self.mapped is None else self.mapped


@dataclass(frozen=True, slots=True)
class DriveBench:
    """Drives that may be moved a little, in both directions from where they are.

    Attributes:
        open: Builds the drives and connects.
        cables: Number of cables.
        period: Time between two exchanges [s].
        travel: How far a cable may be moved [um].
        near: A drive that is so near to its set-point has arrived [um].
        still: A drive that moves less stands still [um].
        answer: Longest time of a call, also of one that is not answered [s].
        arm: Time in which the drives must be on [s].
        stop: Time in which a stop must end, from the moment in which it is asked for [s].
        emulated: Nothing breaks if set-points are sent that drives must refuse, and if zero is set.
        silence: The drives do not answer.
        estop: The emergency stop is pressed.
        clock: Never jumps [s].
        sleep: Waits for a time [s].
    """

    open: Callable[[], Drives]
    cables: int
    period: float = 0.02
    travel: int = 1000
    near: int = 100
    still: int = 20
    answer: float = 0.2
    arm: float = 3.0
    stop: float = 1.0
    emulated: bool = False
    silence: Hook | None = None
    estop: Hook | None = None
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep
