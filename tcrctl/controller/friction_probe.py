"""Finds out before a run whether cables rub in their holes: by how far a small sideways wave throws the end.

A cable that is moved where it rubs pulls harder near the base and bends the base first, and the long lever throws
the end sideways at once. Without friction the end, slow as it is, hardly answers to a quick wave of the drives.
With second differences x' = x(t) - 2 x(t - T/2) + x(t - T), which take out what is constant or changes steadily,

    P = Σ p' e^(-iΩt),   Y = Σ y' e^(-iΩt)  over a wave,     e = |Y| - Y_0 |P|

p the drives along the pattern, y the end, Y_0 the largest |Y| / |P| of frictionless robots whose modes are up to a
fifth slower or faster than the model's. So e is at most about 0 however wrong masses, springs and cameras are, and
more where cables rub. The mean of two waves counts.
"""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

from tcrctl.robot import modes, pose
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Modes with which the answer of the model is found; what is faster follows at once.
MODES: Final = 12
#: How much faster or slower than the model's the modes may be.
WRONG: Final = np.linspace(0.8, 1.2, 9)
#: Amplitude of a wave of the drives that is too small to tell [m].
FAINT: Final = 2e-5
#: Periods of half a wave with which it tells something: with one the end seems to lag, and cables with a friction
#: coefficient of 0.1 seem not to rub.
SHORTEST: Final = 2
#: Waves that have to tell the same.
ENOUGH: Final = 2
#: Steps of a period in which the model's answer is integrated.
STEPS: Final = 20


class FrictionProbe:
    """Finds e of one robot.

    Attributes:
        pattern: How far each drive goes, the farthest by 1 (m,): the longest cables, as they move the end along x.
        frictionless: Y_0 [m/m].
        thrown: e [m]; None as long as it is not known.
    """

    def __init__(self, robot: Robot, half_wave: int, period: float) -> None:
        """Take the robot, half a wave in control periods, and the control period [s]."""
        self.pattern = _pattern(robot)
        self._along = self.pattern / max(float(self.pattern @ self.pattern), 1.0)
        self._half = half_wave
        self.frictionless = _frictionless(robot, self.pattern, half_wave, period)
        self._past: list[Array] = []
        self._thrown: list[float] = []
        self.thrown: float | None = None

    def observe(self, position: Array, drive: Array) -> None:
        """Take the end position (3,) [m] and the drives at the same time (m,) [m], step by step."""
        self._past.append(np.array([self._along @ drive, *position]))
        wave = 2 * self._half
        if len(self._past) >= 2 * wave and len(self._past) % wave == 0:
            self._judge(np.array(self._past[-2 * wave :]))

    def _judge(self, seen: Array) -> None:
        """Find e of two waves of drive and end (2 wave, 4) [m]."""
        size = swing(seen, self._half)
        if np.isfinite(size).all() and size[0] > FAINT:
            self._thrown.append(float(np.linalg.norm(size[1:])) - self.frictionless * float(size[0]))
            if len(self._thrown) >= ENOUGH:
                self.thrown = float(np.mean(self._thrown))


def swing(seen: Array, half: int) -> Array:
    """Return the amplitudes (n,) of a wave of ``2 half`` samples in the last half of ``seen`` (4 half, n)."""
    bent = seen[2 * half :] - 2.0 * seen[half:-half] + seen[: -2 * half]
    turns = np.exp(-1j * np.pi * np.arange(2 * half) / half)
    return np.asarray(np.abs(turns @ bent) / (4.0 * half))


def triangle(half: int, count: int) -> Array:
    """Return the wave of a dither with amplitude 1 at the ends of ``count`` periods, from 0 on (count,).

    A triangle that has its corners at ends of periods: half a wave of an odd number of them begins beside its
    middle, and its first corner is reached early and cut off.
    """
    k = np.arange(count)
    wave = 1.0 - 2.0 * np.abs((k / half + (half // 2) / half) % 2.0 - 1.0)
    if half % 2:
        first = k <= half // 2
        wave[first] = np.minimum(2.0 * k[first] / half, 1.0)
    return np.asarray(wave)


def _pattern(robot: Robot) -> Array:
    """Return the motion of the longest cables that moves the end along x, or else y (m,), the largest one 1.

    Zeros if they move it nowhere sideways.
    """
    holes = np.diff(robot.model.first_hole)
    gain = pose.drive_gain(robot.rest.q, robot.rest.gain, robot.tip)[:2] * (holes == holes.max())
    most = np.abs(gain).max(axis=1)
    row = 0 if most[0] >= 0.5 * most[1] else 1
    return np.asarray(gain[row] / most[row] if most[row] > 0.0 else gain[row])


def _frictionless(robot: Robot, pattern: Array, half: int, period: float) -> float:
    """Return Y_0 [m/m], from the second and third wave of robots that were at rest before."""
    model, first = robot.model, 3 * (robot.tip - FIXED)
    found = modes.modes(model, robot.rest, np.zeros(robot.n_cables), robot.weight, MODES)
    static = robot.rest.gain @ pattern
    part = found.shape.T @ (modes.mass_matrix(model) @ static)
    slow = part[:, None] * found.shape[first : first + 9].reshape(3, 3, -1).mean(axis=0).T
    at_once = static[first : first + 9].reshape(3, 3).mean(axis=0) - slow.sum(axis=0)
    wave = triangle(half, 6 * half)
    followed = _follow(
        (2.0 * np.pi * np.multiply.outer(WRONG, found.frequency)) ** 2, model.damping, wave, period
    )
    answers = []
    for modal in followed:
        end = np.outer(wave, at_once) + modal @ slow
        size = swing(np.column_stack([wave, end])[-4 * half :], half)
        answers.append(float(np.linalg.norm(size[1:]) / size[0]))
    return max(answers)


def _follow(square: Array, damping: float, wave: Array, period: float) -> Array:
    """Move oscillators that are driven by a wave from rest (midpoint rule).

    Args:
        square: Squares of their circular frequencies, of several robots (robots, modes) [1/s2].
        damping: Of all [1/s].
        wave: Where each would rest, at the ends of the periods (n,).
        period: [s].

    Returns:
        Where they are at these times (robots, n, modes).
    """
    step, at, speed = period / STEPS, np.zeros_like(square), np.zeros_like(square)
    ends = [at]
    for before, after in itertools.pairwise(wave):
        for i in range(STEPS):
            target = before + (after - before) * (i + 0.5) / STEPS
            pull = square * (target - at - 0.5 * step * speed) - damping * speed
            speed = speed + step * pull / (1.0 + 0.25 * step**2 * square)
            at = at + step * speed
        ends.append(at)
    return np.stack(ends, axis=1)
