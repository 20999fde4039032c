"""Dither: a small fast motion of the drives that keeps the cables from sticking in their holes.

Friction in the holes makes the end position a relay of the drives' directions: every reversal of a cable throws the
end by millimetres, and a loop that does not know of it hunts. A cable that always slides to and fro feels on the
mean only 2/π asin(U / V) of its friction, with mean speed U and dither speed V: a little damping, no relay.

    triangle wave of the drive lengths, ± A, sign +1 or -1 by cable so that forces and motions cancel
    A grows while the end does not go where the prediction said, and shrinks slowly otherwise

The measure is the innovation: the measured end position against the one predicted a period before, averaged over a
whole wave so that the dither's own trace is not in it. A robot without friction does what is predicted, whatever
else is wrong with its model, so its drives are left in peace. [ADC94]
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Final

import numpy as np

from tcrctl.controller.settings import DitherSettings
from tcrctl.memory import POSITION, Kept
from tcrctl.robot import pose
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Cables up to which all combinations of signs are tried; beyond, signs alternate.
MOST_CABLES: Final = 14


def signs(robot: Robot) -> Array:
    """Return the directions (m,), +1 or -1, with which cables move so that the end is moved least.

    Of all combinations the one with the smallest sum of axial pull (which would shake the column) and of motion of
    the end, weighed by how far a cable reaches; the first cable counts +1.

    Args:
        robot: Its gain at rest says how far a cable moves the end.
    """
    m = robot.n_cables
    if m > MOST_CABLES or m == 1:
        return np.where(np.arange(m) % 2 == 0, 1.0, -1.0)
    gain = pose.drive_gain(robot.rest.q, robot.rest.gain, robot.tip)[:3]
    pull = np.vstack([gain / np.abs(gain).max(), np.ones(m) / m])
    best, least = np.ones(m), np.inf
    for rest in itertools.product((1.0, -1.0), repeat=m - 1):
        trial = np.array([1.0, *rest])
        size = float(np.sum((pull @ trial) ** 2))
        if size < least - 1e-12:
            best, least = trial, size
    return best


class Dither:
    """Adaptive dither of one controller.

    Attributes:
        runs: It is on, and was not told to stand still.
    """

    def __init__(self, settings: DitherSettings | None, period: float, robot: Robot) -> None:
        """Take a ``dither:`` section, or None for none, the control period [s] and the robot."""
        self._settings = settings or DitherSettings()
        self._period = period
        self.runs = settings is not None
        self._half_wave = max(1, round(0.5 / (self._settings.frequency_hz * period)))  # periods
        self._step = (
            self._half_wave // 2
        )  # it begins halfway up, so that the mean of the first wave is zero too
        self._signs = signs(robot) if self.runs else np.zeros(robot.n_cables)
        self._sizes = np.array([self._settings.least_mm / 1e3 if self.runs else 0.0, 0.0])
        self._place = np.zeros(robot.n_cables)
        self._expects, self._expected = False, np.zeros(3)
        self._errors = np.zeros((2 * self._half_wave, 3))
        self._blend = -float(np.expm1(-period / self._settings.filter_s))

    @property
    def amplitude(self) -> float:
        """Half of the travel to and fro [m]."""
        return float(self._sizes[0])

    @property
    def innovation(self) -> float:
        """Filtered size of the innovation over a wave [m]."""
        return float(self._sizes[1])

    def stand_still(self) -> None:
        """Move no drive from now on: under a periodic input a loop has no equilibrium to linearise about."""
        self.runs = False

    def memory(self) -> Mapping[str, Kept]:
        """Return where the dither is, its amplitude and what it compares with, if it runs.

        Its phase is left out: that is time.
        """
        if not self.runs:
            return {}
        kept = {
            "place": self._place,
            "sizes": self._sizes,
            "expected": self._expected,
            "errors": self._errors.ravel(),  # a view
        }
        return {f"dither_{name}": Kept(values, POSITION) for name, values in kept.items()}

    def observe(self, position: Array) -> None:
        """Compare the end position with the one expected a period before, and adapt the amplitude.

        Args:
            position: Measured end position (3,) [m].
        """
        if not (self.runs and self._expects and np.isfinite(position).all()):
            return
        s = self._settings
        self._errors[self._step % self._errors.shape[0]] = position - self._expected
        size = float(np.linalg.norm(np.mean(self._errors, axis=0)))
        amplitude, innovation = self._sizes
        innovation += self._blend * (min(size, s.outlier_mm / 1e3) - innovation)
        excess = innovation - s.threshold_mm / 1e3
        rate = s.growth_1_s * excess if excess > 0.0 else -amplitude / s.release_s
        grown = min(max(amplitude + self._period * rate, s.least_mm / 1e3), s.most_mm / 1e3)
        self._sizes[:] = grown, innovation

    def expect(self, position: Array | None) -> None:
        """Take the end position (3,) [m] that is expected one period from now; None if nothing is."""
        self._expects = position is not None and bool(np.isfinite(position).all())
        self._expected[:] = position if position is not None and self._expects else 0.0

    def speed(self) -> Array:
        """Move on by a period, and return what is added to the drive speeds in it (m,) [m/s]."""
        if not self.runs:
            return np.zeros(self._place.size)
        up = 1.0 if (self._step // self._half_wave) % 2 == 0 else -1.0
        self._step += 1
        ramp = 2.0 * self.amplitude / self._half_wave  # way of a period
        wanted = np.clip(self._place + up * ramp * self._signs, -self.amplitude, self.amplitude)
        moved = wanted - self._place
        self._place[:] = wanted
        return np.asarray(moved / self._period)
