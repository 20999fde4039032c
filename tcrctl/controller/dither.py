"""Dither: a small fast motion of the drives that keeps the cables from sticking in their holes.

Friction in the holes makes the end position a relay of the drives' directions: every reversal of a cable throws the end
by millimetres, and a loop that does not know of it hunts. A cable that always slides to and fro feels on the mean
only 2/π asin(U / V) of its friction, with mean speed U and dither speed V: a little damping, no relay.

    triangle wave of the drive lengths, d_c = ± A, sign +1 or -1 by cable so that forces and motions cancel
    A grows while the end does not go where the prediction said, and shrinks slowly otherwise

The measure is the innovation: the measured end position against the one predicted a period before. A robot without
friction does what is predicted, whatever else is wrong with its model, so its drives are left in peace. [AW89] Sec. 4.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from tcrctl.controller.settings import DitherSettings
from tcrctl.memory import POSITION, Kept
from tcrctl.robot import pose
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Cables up to which all combinations of signs are tried; beyond, signs alternate.
MOST_CABLES = 14


def signs(robot: Robot) -> Array:
    """Return the directions (m,), +1 or -1, with which cables move so that the end is moved least.

    Of all combinations the one with the smallest sum of axial pull (which would shake the column) and of lateral
    pull at the end ring, both weighed by the tension and by how far a cable reaches; the first cable counts +1.
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
        amplitude: Half of the travel to and fro [m].
        innovation: Filtered size of the innovation [m].
    """

    def __init__(self, settings: DitherSettings | None, period: float, robot: Robot) -> None:
        """Take a ``dither:`` section, or None for none, and the control period [s]."""
        self._settings, self._period = settings, period
        self.amplitude = self.innovation = 0.0
        if settings is None:
            return
        self.amplitude = settings.least_mm / 1e3
        self._half_wave = max(1, round(0.5 / (settings.frequency_hz * period)))
        self._signs, self._step = signs(robot), 0
        self._place = np.zeros(robot.n_cables)
        self._expected: Array | None = None
        self._errors = np.zeros((2 * self._half_wave, 3))
        self._blend = -float(np.expm1(-period / settings.filter_s))

    def memory(self) -> Mapping[str, Kept]:
        """Return where the dither stands, if there is one."""
        return {} if self._settings is None else {"dither": Kept(self._place, POSITION)}

    def observe(self, position: Array) -> None:
        """Compare the end position (3,) [m] with what was expected a period before; moves the amplitude."""
        s = self._settings
        if s is None or self._expected is None:
            return
        self._errors[self._step % self._errors.shape[0]] = position - self._expected
        size = float(
            np.linalg.norm(np.mean(self._errors, axis=0))
        )  # over a whole wave: without its own trace
        self.innovation += self._blend * (min(size, s.outlier_mm / 1e3) - self.innovation)
        excess = self.innovation - s.threshold_mm / 1e3
        rate = s.growth_1_s * excess if excess > 0.0 else -self.amplitude / s.release_s
        most, least = s.most_mm / 1e3, s.least_mm / 1e3
        self.amplitude = min(max(self.amplitude + self._period * rate, least), most)

    def expect(self, position: Array | None) -> None:
        """Take the end position (3,) [m] that is expected one period from now; None if nothing is."""
        self._expected = position

    def speed(self) -> Array | float:
        """Return what is added to the drive speeds of the coming period (m,) [m/s]."""
        if self._settings is None:
            return 0.0
        self._step += 1
        up = 1.0 if (self._step // self._half_wave) % 2 == 0 else -1.0
        ramp = (
            2.0 * self.amplitude / self._half_wave
        )  # per period; halfway at first, so that the mean is zero
        wanted = np.clip(self._place + up * ramp * self._signs, -self.amplitude, self.amplitude)
        moved = wanted - self._place
        self._place = wanted
        return np.asarray(moved / self._period)
