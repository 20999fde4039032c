"""A hand on the drives: sends set-points in small steps, at the pace of a loop."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import DeviceError, StoppedError
from tcrctl.plant.rig.devices import DriveControl, DriveStatus
from tcrctl.testing.bench import DriveBench
from tcrctl.testing.broken import require

ON: Final = DriveControl(enable=True, permit=True)
MOVING: Final = DriveControl(enable=True, permit=True, follow=True)
STOPPING: Final = DriveControl(enable=True)
OFF: Final = DriveControl()
#: Set-points go so fast if drives do not say how fast they may [um/s], and never faster.
SPEED: Final = 5000.0


class Hand:
    """Drives that are open.

    Attributes:
        drives: The device.
        target: Set-points that were sent last (m,) [um].
    """

    def __init__(self, bench: DriveBench) -> None:
        """Open the drives and ask where they are."""
        self._bench, self.drives = bench, bench.open()
        self.target = self.ask().position.copy()

    @classmethod
    @contextmanager
    def on(cls, bench: DriveBench) -> Iterator[Self]:
        """Open drives; whatever happens they are switched off and closed."""
        hand = cls(bench)
        try:
            yield hand
        finally:
            with suppress(DeviceError, StoppedError):
                hand.drives.exchange(hand.drives.status().position, OFF)
            hand.drives.close()

    def ask(self) -> DriveStatus:
        """Return the status."""
        return self._checked("status", self.drives.status())

    def send(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Exchange once, and wait for the rest of the period."""
        self.target = target
        begun, given = self._bench.clock(), target.copy()
        found = self._checked("exchange", self.drives.exchange(given, control))
        require(
            bool(np.array_equal(given, target)), "exchange leaves the set-points that it is given as they are"
        )
        took = self._bench.clock() - begun
        self._bench.sleep(max(0.0, self._bench.period - took))
        return found

    def arm(self) -> DriveStatus:
        """Switch the drives on, where they are."""
        end, found = self._bench.clock() + self._bench.arm, self.ask()
        require(not found.enabled, "the drives are off before they are switched on")
        place = found.position.copy()
        while not (found.enabled and found.acknowledged):
            require(
                self._bench.clock() < end, f"the drives are on within {self._bench.arm:g} s: {_why(found)}"
            )
            found = self.send(place, ON)
        return found

    def reset(self) -> DriveStatus:
        """Clear what is latched."""
        place = self.ask().position
        for control in (OFF, replace(OFF, reset=True), OFF):
            for _ in range(3):
                found = self.send(place, control)
        return found

    def go(self, goal: NDArray[np.int64]) -> DriveStatus:
        """Send set-points in small steps until the goal is sent."""
        limits = self.drives.limits
        step = max(1, int(min(0.8 * limits.step, 0.5 * min(limits.speed, SPEED) * self._bench.period)))
        found = self.ask()
        while not np.array_equal(self.target, goal):
            found = self.send(self.target + np.clip(goal - self.target, -step, step), MOVING)
            require(not found.reject, f"set-points inside all limits are taken, not refused: {found.reject}")
        return found

    def arrive(self, goal: NDArray[np.int64]) -> DriveStatus:
        """Go, and wait until the drives are there."""
        found, end = self.go(goal), self._bench.clock() + self._bench.stop
        while np.abs(found.position - goal).max() > self._bench.near:
            late = f"drives arrive within {self._bench.stop:g} s: sent to {goal}, at {found.position} um"
            require(self._bench.clock() < end, late)
            found = self.send(goal, MOVING)
        return found

    def goal(self, cable: int | None = None) -> NDArray[np.int64]:
        """Return a place within travel and limits for one cable, or for all of them (m,) [um]."""
        limits, travel = self.drives.limits, self._bench.travel
        room = np.where(self.target + travel < limits.high, travel, -travel)
        chosen = np.arange(self._bench.cables) == cable
        return self.target + (room if cable is None else np.where(chosen, room, 0)).astype(np.int64)

    def keeps(self, seconds: float, target: NDArray[np.int64], control: DriveControl) -> int:
        """Send the same for a while; returns how far the drives have moved meanwhile [um]."""
        before, end, most = self.ask().position.copy(), self._bench.clock() + seconds, 0
        while self._bench.clock() < end:
            position = self.send(target, control).position
            most = max(most, int(np.abs(position - before).max()))
        return most

    def _checked(self, name: str, found: Any) -> DriveStatus:
        kind = type(found).__name__
        require(isinstance(found, DriveStatus), f"{name} returns a DriveStatus, not a {kind}")
        status: DriveStatus = found
        position, m = status.position, self._bench.cables
        require(position.shape == (m,), f"{name}: positions of {m} cables, not of shape {position.shape}")
        whole = np.issubdtype(position.dtype, np.integer)
        require(bool(whole), f"{name}: positions in whole micrometres, not {position.dtype}")
        return status


def _why(found: DriveStatus) -> str:
    return found.fault or found.reject or "they do not say why"
