"""Dither: a small fast motion of the drives that keeps the cables from sticking in their holes.

Friction in the holes makes the end position a relay of the drives' directions: every reversal of a cable throws the
end by millimetres, and a loop that does not know of it hunts. A cable that always slides to and fro feels on the
mean only 2/π asin(U / V) of its friction, with mean speed U and dither speed V: a little damping, no relay.

    triangle wave of the drive lengths, ± A, sign +1 or -1 by cable so that forces and motions cancel
    A grows while less of the wave than ``reach`` gets along the robot, and shrinks while more does

Where cables rub the first holes use a small wave up (controller.wave_reach). A robot without friction lets it pass,
so its drives are soon left in peace. A dither that sleeps is woken, as large as at the start, by the innovation:
the measured end position against the one predicted a period before, averaged over a whole wave so that the dither's
own trace is not in it, less a part of the motion that was predicted: a wrong model misses by that, too. If cables
of one length move against each other, nothing is seen of the wave, and the innovation alone lets it grow. [ADC94]
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from tcrctl.controller.settings import DitherSettings
from tcrctl.controller.wave_reach import WaveReach
from tcrctl.memory import POSITION, Kept
from tcrctl.robot.robot import Robot
from tcrctl.robot.swing import signs
from tcrctl.signals import Array, Estimate

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

    def __init__(self, settings: DitherSettings | None, period: float, robot: Robot, limit: float) -> None:
        """Take a ``dither:`` section or None for none, the control period [s], the robot, the speed limit [m/s]."""
        self._settings = settings or DitherSettings()
        self._period = period
        self.runs = settings is not None
        self._half_wave = max(1, round(0.5 / (self._settings.frequency_hz * period)))  # periods
        self._step = (
            self._half_wave // 2
        )  # it begins halfway up, so that the mean of the first wave is zero too
        self._signs = signs(robot) if self.runs else np.zeros(robot.n_cables)
        self._most = min(
            self._settings.most_mm / 1e3, self._settings.speed_part * limit * self._half_wave * period / 2.0
        )
        self._start = _start(self._settings, self._most)
        self._sizes = np.array([self._start if self.runs else 0.0, 0.0])
        self._reach = WaveReach(robot, self._signs, self._half_wave)
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
    def fastest(self) -> float:
        """Speed of the drives in the wave [m/s]."""
        return 2.0 * self.amplitude / (self._half_wave * self._period)

    @property
    def reach(self) -> float:
        """Part of the wave that gets along the robot."""
        return self._reach.share

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
        own = {name: Kept(values, POSITION) for name, values in kept.items()}
        return {f"dither_{name}": values for name, values in {**own, **self._reach.memory()}.items()}

    def observe(self, position: Array, estimate: Estimate) -> None:
        """Look at what has become of the wave and of the expected motion, and adapt the amplitude.

        Args:
            position: Measured end position (3,) [m].
            estimate: The robot, and where its drives are.
        """
        if not (self.runs and np.isfinite(position).all() and np.isfinite(estimate.q).all()):
            self._position[:] = position
            return
        self._reach.observe(estimate.q, estimate.drive)
        self._surprise(position)
        amplitude, innovation = self._sizes
        grown = amplitude + self._period * self._rate(amplitude, innovation)
        least = min(self._settings.least_mm / 1e3, self._most)
        self._sizes[0] = min(max(grown, least), self._most)

    def _rate(self, amplitude: float, innovation: float) -> float:
        """Return by how much the amplitude [m] grows [m/s]."""
        s, excess = self._settings, innovation - self._settings.threshold_mm / 1e3
        if excess > 0.0 and not self._reach.sees:
            self._woken = True
            return s.growth_1_s * excess
        if excess > 0.0 and amplitude < self._start:
            return min(s.growth_1_s * excess, (self._start - amplitude) / self._period)
        missed = 1.0 - self.reach / s.reach
        if missed > 0.0 and self._reach.tells:
            self._woken = True
            return s.spread_1_s * missed * amplitude
        return -amplitude / (s.release_s if self._woken else s.settle_s)

    def _surprise(self, position: Array) -> None:
        """Compare the end position (3,) [m] with the one expected a period before."""
        if not self._expects:
            self._position[:] = position
            return
        s = self._settings
        self._errors[self._step % self._errors.shape[0]] = position - self._expected
        self._motions[self._step % self._motions.shape[0]] = self._expected - self._position
        self._position[:] = position
        size = float(np.linalg.norm(np.mean(self._errors, axis=0)))
        size = max(size - s.motion_part * float(np.linalg.norm(np.mean(self._motions, axis=0))), 0.0)
        self._sizes[1] += self._blend * (min(size, s.outlier_mm / 1e3) - self._sizes[1])

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


def _start(settings: DitherSettings, most: float) -> float:
    """Return the amplitude at the start [m], given the largest one [m]."""
    return min(max(settings.least_mm, settings.start_mm) / 1e3, most)
