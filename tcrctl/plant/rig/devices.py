"""What a bench needs of cameras and drives, in SI units and in the order of the robot's nodes and cables.

An object that has the members of :class:`Cameras`, or of :class:`Drives`, works wherever the shipped ones do: in
runs, and in every ``tcrctl rig`` verb. :mod:`tcrctl.testing` tries whether one keeps what is said here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tcrctl.plant.rig.finding import Finding
from tcrctl.signals import RawFrame


@dataclass(frozen=True, slots=True)
class Identity:
    """Who a device is, as it says itself.

    Attributes:
        name: What it is called in tables, for instance ``PLC``.
        where: What it is called in messages, with its place: ``PLC at 10.0.0.2:502``.
        text: What it says about itself, one line; empty if nothing.
        details: The same by name, for ``--json``.
    """

    name: str
    where: str
    text: str = ""
    details: Mapping[str, str] = field(default_factory=dict)


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


@dataclass(frozen=True, slots=True)
class CameraStatus:
    """How a stream of frames goes, counted since it was opened.

    Attributes:
        lost: Frames that never came.
        malformed: What came and could not be understood.
        impossible: Frames whose time stamp cannot be true; dated by their arrival.
        markers: Markers in the newest frame, whatever they sit on.
    """

    lost: int = 0
    malformed: int = 0
    impossible: int = 0
    markers: int = 0


class Cameras(Protocol):
    """A stream of marker frames, mapped to the nodes of a robot; opened when it is built.

    Frames are received in the background: a loop that is late gets the newest one, not the oldest.
    """

    @property
    def identity(self) -> Identity:
        """Who streams."""
        ...

    @property
    def rate(self) -> float:
        """Frames per second [Hz]."""
        ...

    @property
    def clock(self) -> str:
        """Empty if frames say when they were taken, and that is known on ``time.monotonic``; else why not.

        Then ``Sighting.taken`` is the arrival, and how old frames are when they arrive is not known.
        """
        ...

    def next(self, timeout: float, *, fresh: bool) -> Sighting | None:
        """Return the newest frame not returned before; None if none comes within ``timeout`` [s].

        A frame that repeats the one before bit for bit was not taken anew and is none.

        Args:
            timeout: How long a frame is waited for [s].
            fresh: Wait for the next one to arrive, and take one that is here already only if none does.

        Raises:
            DeviceError: If the stream cannot be understood any more; a run is stopped.
        """
        ...

    def status(self) -> CameraStatus:
        """Return how the stream has gone so far; asks nobody.

        Raises:
            DeviceError: If that cannot be told any more.
        """
        ...

    def checks(self, seen: Sequence[Sighting]) -> Iterable[Finding]:
        """Yield what only this kind of cameras knows to look at, for ``tcrctl rig check``; may be nothing.

        Args:
            seen: Frames that were taken in a second before.

        Raises:
            DeviceError: If the device is lost.
        """
        ...

    def close(self) -> None:
        """End the stream; may be called twice; never raises."""
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


@dataclass(frozen=True, slots=True)
class DeviceLimits:
    """What drives allow by themselves, whatever they are sent; infinite where they do not say.

    Attributes:
        low: Least cable lengths taken in (m,) [um].
        high: Largest ones (m,) [um].
        speed: Largest speed [um/s].
        step: Largest change of a set-point from one exchange to the next [um].
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    speed: float = float("inf")
    step: float = float("inf")


class Drives(Protocol):
    """The cable drives behind a PLC or bus; connected when they are built, and nothing is written then."""

    @property
    def identity(self) -> Identity:
        """Who moves the cables."""
        ...

    @property
    def limits(self) -> DeviceLimits:
        """What they allow; what a rig file allows has to lie inside."""
        ...

    @property
    def watchdog(self) -> float | None:
        """Time without an exchange after which they stop and hold by themselves [s].

        None if they never do: then a program that dies leaves nobody in charge, and they are not armed.
        """
        ...

    def load(self, period: float) -> float:
        """Return the share of a control period [s] that an exchange takes on the wire; 0 if next to nothing.

        Raises:
            InputError: If the period is too short.
        """
        ...

    def status(self) -> DriveStatus:
        """Read what the drives report; does not feed the watchdog.

        Raises:
            DeviceError: If they do not answer.
        """
        ...

    def exchange(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Send set-points (m,) [um] and control bits, once per cycle; feeds the watchdog.

        The drives move only while ``enable``, ``follow`` and ``permit`` are set. Without ``permit`` they come to a
        controlled stop, and are off when they stand.

        Raises:
            ArmingRefusedError: If another program moves them.
            UntrustworthyDeviceError: If they answer what cannot be true.
            DeviceError: If they do not answer; the exchange may have reached them or not.
        """
        ...

    def checks(self) -> Iterable[Finding]:
        """Yield what only this kind of drives knows to look at, for ``tcrctl rig check``; may be nothing.

        Raises:
            DeviceError: If the device is lost.
        """
        ...

    def close(self) -> None:
        """End the connection and nothing else: no motion, no stop. May be called twice; never raises."""
        ...
