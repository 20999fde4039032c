"""A cable drive that follows its set-point as a position-controlled servo does: late, and within its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ServoSettings:
    """Behaviour of one drive.

    Attributes:
        lag_s: Time constant of the position loop [s].
        speed_um_s: Largest speed [um/s].
        acceleration_um_s2: Largest acceleration [um/s2].
        backlash_um: Play between the drive and its cable [um].
    """

    lag_s: float = 0.02
    speed_um_s: float = 200_000.0
    acceleration_um_s2: float = 20_000_000.0
    backlash_um: float = 0.0


class Servo:
    """One drive.

    Attributes:
        position: Of the encoder [um].
        speed: Its rate of change [um/s].
        output: Cable taken in; lags behind the encoder by the play [um].
        jammed: The shaft does not move.
    """

    __slots__ = ("_settings", "jammed", "output", "position", "speed")

    def __init__(self, settings: ServoSettings, position: float = 0.0) -> None:
        """Stand at ``position`` [um]."""
        self._settings = settings
        self.position = self.output = position
        self.speed = 0.0
        self.jammed = False

    def step(self, setpoint: float, dt: float) -> None:
        """Follow a set-point [um] for ``dt`` [s].

        The wanted speed is error / lag, never more than what the drive can still brake from before the set-point,
        so that it does not overshoot.
        """
        if self.jammed:
            self.speed = 0.0
            return
        limits, error = self._settings, setpoint - self.position
        size = abs(error)
        wanted = min(size / max(limits.lag_s, dt), limits.speed_um_s, braking_speed(size, limits, dt))
        change = limits.acceleration_um_s2 * dt
        wanted = math.copysign(wanted, error)
        self.speed = min(max(wanted, self.speed - change), self.speed + change)
        self.position += self.speed * dt
        half = 0.5 * limits.backlash_um
        self.output = min(max(self.output, self.position - half), self.position + half)


def braking_speed(distance: float, limits: ServoSettings, dt: float) -> float:
    """Largest speed from which a drive stops within a distance, when its speed changes once per ``dt`` only.

    Braking from (n + f) steps of speed, 0 <= f < 1, takes (n + 1) (n / 2 + f) steps of distance.
    """
    change = limits.acceleration_um_s2 * dt
    steps = distance / (change * dt)
    whole = math.floor(0.5 * (math.sqrt(1.0 + 8.0 * steps) - 1.0))
    return change * (whole + steps / (whole + 1) - 0.5 * whole)
