"""Dither: a small fast motion of the drives that keeps the cables from sticking in their holes.

Friction in the holes makes the end position a relay of the drives' directions: every reversal of a cable throws the
end by millimetres, and a loop that does not know of it hunts. A cable that always slides to and fro feels on the
mean only 2/π asin(U / V) of its friction, with mean speed U and dither speed V: a little damping, no relay.

    triangle wave of the drive lengths, ± A, sign +1 or -1 by cable so that forces and motions cancel
    A grows while the end does not go where the prediction said, and shrinks slowly otherwise

The measure is the innovation: the measured end position against the one predicted a period before, averaged over a
whole wave so that the dither's own trace is not in it, less a part of the motion that was predicted: a wrong model
misses by that, too. A robot without friction does not miss by more, so its drives are left in peace. [ADC94]
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from tcrctl.controller.settings import DitherSettings
from tcrctl.memory import POSITION, Kept
from tcrctl.robot.robot import Robot
from tcrctl.robot.swing import signs
from tcrctl.signals import Array

#: From this amplitude on a robot counts as dithered, with weights and gains of its own [m].
AWAKE: Final = 0.5e-3


class Dithered(NamedTuple):
    """What a dither does at one moment.

    Attributes:
        amplitude: Half of the travel to and fro [m].
        place: Where it has moved the drives (m,) [m].
    """

    amplitude: float
    place: Array

    @property
    def awake(self) -> float:
        """How far the dither has grown, 0 to 1."""
        return min(self.amplitude / AWAKE, 1.0)


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
        self._sizes = np.array([_start(self._settings) if self.runs else 0.0, 0.0])
        self._woken = False
        self._place = np.zeros(robot.n_cables)
        self._expects, self._expected = False, np.zeros(3)
        self._position, self._motions = np.zeros(3), np.zeros((2 * self._half_wave, 3))
        self._errors = np.zeros((2 * self._half_wave, 3))
        self._blend = -float(np.expm1(-period / self._settings.filter_s))

    @property
    def amplitude(self) -> float:
        """Half of the travel to and fro [m]."""
        return float(self._sizes[0])

    @property
    def now(self) -> Dithered:
        """Amplitude, and where the drives are in the wave."""
        return Dithered(self.amplitude, self._place.copy())

    @property
    def innovation(self) -> float:
        """Filtered size of the innovation over a wave [m]."""
        return float(self._sizes[1])

    def stand_still(self) -> None:
        """Move no drive from now on: under a periodic input a loop has no equilibrium to linearise about."""
        self.runs = False
        self._sizes[:] = 0.0
        self._place[:] = 0.0

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
            "position": self._position,
            "errors": self._errors.ravel(),  # a view
            "motions": self._motions.ravel(),
        }
        return {f"dither_{name}": Kept(values, POSITION) for name, values in kept.items()}

    def observe(self, position: Array) -> None:
        """Compare the end position with the one expected a period before, and adapt the amplitude.

        Args:
            position: Measured end position (3,) [m].
        """
        if not (self.runs and self._expects and np.isfinite(position).all()):
            self._position[:] = position
            return
        s = self._settings
        self._errors[self._step % self._errors.shape[0]] = position - self._expected
        self._motions[self._step % self._motions.shape[0]] = self._expected - self._position
        self._position[:] = position
        size = float(np.linalg.norm(np.mean(self._errors, axis=0)))
        size = max(size - s.motion_part * float(np.linalg.norm(np.mean(self._motions, axis=0))), 0.0)
        amplitude, innovation = self._sizes
        innovation += self._blend * (min(size, s.outlier_mm / 1e3) - innovation)
        excess = innovation - s.threshold_mm / 1e3
        self._woken = self._woken or excess > 0.0
        decay = s.release_s if self._woken else s.settle_s
        rate = s.growth_1_s * excess if excess > 0.0 else -amplitude / decay
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


def _start(settings: DitherSettings) -> float:
    """Return the amplitude at the start [m]."""
    return max(settings.least_mm, min(settings.start_mm, settings.most_mm)) / 1e3
