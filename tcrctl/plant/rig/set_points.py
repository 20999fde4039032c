"""Drive speeds become set-points in whole micrometres, inside every limit, from the last one that was accepted.

    speed -> finite -> speed limit -> acceleration limit -> integrate, round -> step limit -> stroke
          -> sum of antagonists -> set-points [um]

What is rounded away is kept, so that slow motion does not drift. Everything is checked again on the whole numbers
that are sent: whatever the controller asks, a set-point is inside the stroke and at most one step from the last.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array

Micrometres = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class AntagonistGroup:
    """Cables round one segment: together they may neither crush the robot nor all be slack.

    Attributes:
        cables: Their indices.
        low: Smallest sum of their drive lengths [um].
        high: Largest sum [um].
    """

    cables: tuple[int, ...]
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class DriveEnvelope:
    """What set-points must keep; everything per cable (m,), whole micrometres and seconds.

    Attributes:
        names: Names of the cables.
        low: Shortest drive lengths [um].
        high: Longest drive lengths [um].
        change: Most that a set-point may change from one write to the next [um].
        speed: Largest speeds [um/s].
        acceleration: Largest change of speed [um/s2]; infinite if it is not limited.
        groups: Cables whose sum is limited.
    """

    names: tuple[str, ...]
    low: Micrometres
    high: Micrometres
    change: Micrometres
    speed: Array
    acceleration: Array
    groups: tuple[AntagonistGroup, ...] = ()

    def outside(self, position: Micrometres) -> list[str]:
        """Say which drives at ``position`` (m,) [um] are beyond their stroke."""
        return [
            f"cable {self.names[c]} is at {position[c] / 1e3:.2f} mm, outside its limits "
            f"{self.low[c] / 1e3:g} to {self.high[c] / 1e3:g} mm"
            for c in np.flatnonzero((position < self.low) | (position > self.high))
        ]


@dataclass(frozen=True, slots=True)
class Clamp:
    """A command that was not sent as it was wanted.

    Attributes:
        cable: Name of the cable.
        rule: Limit that acted.
        wanted: Value asked for.
        sent: Value used instead.
        unit: Unit of both.
    """

    cable: str
    rule: str
    wanted: float
    sent: float
    unit: str

    def __str__(self) -> str:
        return (
            f"cable {self.cable}: {self.rule}: wanted {self.wanted:.3f} {self.unit}, "
            f"sent {self.sent:.3f} {self.unit}"
        )


class SetPoints:
    """Integrates the speeds of one armed period.

    Attributes:
        accepted: Last set-points that the drives got and did not refuse (m,) [um].
    """

    def __init__(self, envelope: DriveEnvelope, period: float, start: Sequence[int]) -> None:
        """Begin without a bump.

        Args:
            envelope: The limits.
            period: Time between two writes [s].
            start: Where the drives are (m,) [um].
        """
        self._envelope, self._period = envelope, period
        self.accepted: Micrometres = np.array(start, dtype=np.int64)
        self._before, self._exact = self.accepted, self.accepted.astype(float)
        self._speed = np.zeros(self.accepted.shape[0])
        self._next = self.accepted
        self._next_exact = self._exact
        self._next_speed = self._speed

    def propose(self, speed: Array) -> tuple[Micrometres, tuple[Clamp, ...]]:
        """Return set-points for the coming period, and what had to be changed to stay inside the limits.

        Args:
            speed: Wanted speeds (m,) [m/s].
        """
        clamps: list[Clamp] = []
        with np.errstate(over="ignore"):  # infinite is refused below
            wanted = 1e6 * np.asarray(speed, dtype=float)
        moving = self._allowed_speed(wanted, clamps)
        exact = self._exact + self._period * moving
        whole = self._allowed_positions(np.rint(exact).astype(np.int64), clamps)
        free = np.abs(whole - exact) <= 0.5
        self._next, self._next_exact = whole, np.where(free, exact, whole)
        self._next_speed = np.where(free, moving, (whole - self.accepted) / self._period)
        return whole, tuple(clamps)

    def accept(self) -> None:
        """Note that the drives have got what was proposed last."""
        self._before = self.accepted
        self.accepted = self._next
        self._exact = self._next_exact
        self._speed = self._next_speed

    def start_again(self) -> None:
        """Note that they have not got it: the next proposal starts at what they got before, from standstill."""
        self._exact, self._speed = self.accepted.astype(float), np.zeros_like(self._speed)

    def take_back(self) -> None:
        """Note that they have refused what they got last: the one before is still in force."""
        self.accepted = self._before
        self.start_again()

    def _allowed_speed(self, wanted: Array, clamps: list[Clamp]) -> Array:
        e, change = self._envelope, self._envelope.acceleration * self._period
        finite = np.where(np.isfinite(wanted), wanted, 0.0)
        self._note(clamps, "not a finite number", wanted, finite, 1e3, "mm/s")
        slow = np.clip(finite, -e.speed, e.speed)
        self._note(clamps, "speed limit", finite, slow, 1e3, "mm/s")
        smooth = np.clip(slow, self._speed - change, self._speed + change)
        self._note(clamps, "acceleration limit", slow, smooth, 1e3, "mm/s")
        return np.asarray(smooth)

    def _allowed_positions(self, wanted: Micrometres, clamps: list[Clamp]) -> Micrometres:
        e = self._envelope
        near = np.clip(wanted, self.accepted - e.change, self.accepted + e.change)
        self._note(clamps, "step limit", wanted, near, 1e3, "mm")
        # a start outside the stroke may only move inwards, and not faster than the step limit
        inside = np.clip(near, np.minimum(e.low, self.accepted), np.maximum(e.high, self.accepted))
        self._note(clamps, "stroke limit", near, inside, 1e3, "mm")
        for group in e.groups:
            self._hold_antagonists(group, inside, clamps)
        return inside

    def _hold_antagonists(self, group: AntagonistGroup, target: Micrometres, clamps: list[Clamp]) -> None:
        """Hold all cables of a group whose sum would leave its range, or go further away from it."""
        cables = list(group.cables)
        total, before = int(target[cables].sum()), int(self.accepted[cables].sum())
        over = max(total - group.high, group.low - total)
        if over <= max(0, before - group.high, group.low - before):
            return
        names = "+".join(self._envelope.names[c] for c in cables)
        clamps.append(Clamp(names, "sum of antagonists", total / 1e3, before / 1e3, "mm"))
        target[cables] = self.accepted[cables]

    def _note(
        self,
        clamps: list[Clamp],
        rule: str,
        wanted: Array | Micrometres,
        sent: Array | Micrometres,
        scale: float,
        unit: str,
    ) -> None:
        if not np.array_equal(wanted, sent):
            for c in np.flatnonzero(wanted != sent):
                name = self._envelope.names[c]
                clamps.append(Clamp(name, rule, float(wanted[c]) / scale, float(sent[c]) / scale, unit))


class ClampNotes:
    """Reports where clamping begins and ends; every step's wanted and sent values are in its record."""

    def __init__(self, report: Callable[[str, str, str], None]) -> None:
        """Begin without clamps; ``report`` takes kind, level and text."""
        self._report = report
        self._steps: dict[tuple[str, str], int] = {}

    def note(self, clamps: tuple[Clamp, ...]) -> None:
        """Take the clamps of one step."""
        now = {(clamp.cable, clamp.rule): clamp for clamp in clamps}
        for cable, rule in [key for key in self._steps if key not in now]:
            steps = self._steps.pop((cable, rule))
            self._report("clamp", "info", f"cable {cable}: {rule}: over after {steps} steps")
        for key, clamp in now.items():
            if key not in self._steps:
                self._report("clamp", "warning", str(clamp))
            self._steps[key] = self._steps.get(key, 0) + 1
