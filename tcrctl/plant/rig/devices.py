"""What the rig plant needs of cameras and drives, in SI units and in the order of the robot's nodes and cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import RawFrame


@dataclass(frozen=True, slots=True)
class Sighting:
    """One frame of the cameras, mapped to the robot.

    Attributes:
        taken: Middle of the exposure on ``time.monotonic`` [s].
        nodes: Ring nodes of all free modules (n_markers, 3), world frame [m]; anything where not valid.
        valid: Which of them can be trusted (n_markers,).
        doubts: Why the others cannot: reason and how many, for instance ``3 jump``.
        raw: The markers as they came.
    """

    taken: float
    nodes: NDArray[np.float32]
    valid: NDArray[np.bool_]
    doubts: str
    raw: RawFrame


class Cameras(Protocol):
    """A stream of marker frames.

    Attributes:
        rate: Frames per second [Hz].
    """

    rate: float

    def next(self, timeout: float, *, fresh: bool) -> Sighting | None:
        """Return the newest frame not returned before; None if none comes within ``timeout`` [s].

        Args:
            timeout: How long a frame is waited for [s].
            fresh: Wait for the next one to arrive, and take one that is here already only if none does.

        Raises:
            DeviceError: If the stream cannot be understood any more.
        """
        ...

    def close(self) -> None:
        """End the stream; never raises."""
        ...


@dataclass(frozen=True, slots=True)
class DriveControl:
    """What the drives are told beside set-points.

    Attributes:
        enable: Switch the drives on.
        follow: Take the set-points.
        permit: Run permit; without it the PLC brings the drives to a controlled stop.
        reset: Clear latched faults; acts when it becomes true.
        zero: Make the present positions zero; acts when it becomes true.
    """

    enable: bool = False
    follow: bool = False
    permit: bool = False
    reset: bool = False
    zero: bool = False


@dataclass(frozen=True, slots=True)
class DriveStatus:
    """What the drives report.

    Attributes:
        position: Cable lengths taken in since tension-zero (m,) [um].
        enabled: The drives hold and move.
        zeroed: Tension-zero is known.
        stopping: A controlled stop is going on.
        estop: The emergency stop is pressed.
        watchdog: The PLC's watchdog has stopped the drives, latched.
        fault: Empty, or the latched fault.
        following_error: A drive does not keep up, as the PLC sees it.
        remote: The PLC listens to this program.
        reject: Empty, or why the PLC did not take the last set-points that it has looked at.
        acknowledged: The PLC has seen the last set-points; a lag of one exchange counts as seen.
        slack: The PLC finds a cable slack.
        round_trip: Time of the exchange [s].
    """

    position: NDArray[np.int64]
    enabled: bool = False
    zeroed: bool = False
    stopping: bool = False
    estop: bool = False
    watchdog: bool = False
    fault: str = ""
    following_error: bool = False
    remote: bool = True
    reject: str = ""
    acknowledged: bool = True
    slack: bool = False
    round_trip: float = 0.0


class Drives(Protocol):
    """The cable drives behind a PLC."""

    def status(self) -> DriveStatus:
        """Read what the drives report; does not feed the watchdog.

        Raises:
            DeviceError: If they do not answer.
        """
        ...

    def exchange(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Send set-points (m,) [um] and control bits, once per cycle; feeds the watchdog.

        Raises:
            DeviceError: If they do not answer, or answer nonsense.
        """
        ...

    def close(self) -> None:
        """End the connection and nothing else; never raises."""
        ...
