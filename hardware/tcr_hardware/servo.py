"""A cable drive: a set-point on one side, cable taken in on the other, and what comes between them.

    set-point -> dead time -> counts -> position loop with lag and limits -> encoder -> play -> winch -> cable

The emulated PLC and the simulated plant move their cables by it. Nothing in it knows where it is used.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class ServoSettings:
    """Behaviour of one drive.

    Attributes:
        lag_s: Time constant of the position loop [s].
        speed_um_s: Largest speed [um/s].
        acceleration_um_s2: Largest acceleration [um/s2].
        backlash_um: Play between the drive and its cable [um].
        dead_time_s: Time by which set-points arrive late [s].
        count_um: Set-points are rounded to whole counts of the encoder [um]; 0: not at all.
        radius_error: By which part the winch takes in more cable than the drive believes.
        zero_error_um: Cable that is taken in when the drive believes that it stands at zero [um].
    """

    lag_s: float = 0.02
    speed_um_s: float = 200_000.0
    acceleration_um_s2: float = 20_000_000.0
    backlash_um: float = 0.0
    dead_time_s: float = 0.0
    count_um: float = 0.0
    radius_error: float = 0.0
    zero_error_um: float = 0.0


def in_unit(settings: ServoSettings, unit: float) -> ServoSettings:
    """Return settings whose lengths are counted in units of so many micrometres; encoder counts are left out."""
    return replace(
        settings,
        speed_um_s=settings.speed_um_s / unit,
        acceleration_um_s2=settings.acceleration_um_s2 / unit,
        backlash_um=settings.backlash_um / unit,
        count_um=0.0,
        zero_error_um=settings.zero_error_um / unit,
    )


class DeadTime:
    """A signal that arrives late; between its values it is taken for a straight line."""

    __slots__ = ("_delay", "_points", "_time")

    def __init__(self, delay: float, value: float) -> None:
        """Be at ``value`` since ever; ``delay`` [s]."""
        self._delay, self._time = delay, 0.0
        self._points: deque[tuple[float, float]] = deque([(0.0, value)])

    def __call__(self, value: float, dt: float) -> float:
        """Return what arrives ``dt`` [s] after the last call, when ``value`` is sent."""
        if self._delay <= 0.0:
            return value
        self._time += dt
        points, wanted = self._points, self._time - self._delay
        points.append((self._time, value))
        while points[1][0] <= wanted:
            points.popleft()
        (t0, x0), (t1, x1) = points[0], points[1]
        return x0 if wanted <= t0 else x0 + (x1 - x0) * (wanted - t0) / (t1 - t0)


class Servo:
    """One drive.

    Attributes:
        position: Of the encoder [um].
        speed: Its rate of change [um/s].
        shaft: Position behind the play [um].
        jammed: The shaft does not move.
    """

    __slots__ = ("_arriving", "_settings", "jammed", "position", "shaft", "speed")

    def __init__(self, settings: ServoSettings, position: float = 0.0) -> None:
        """Stand at ``position`` [um]."""
        self._settings = settings
        self._arriving = DeadTime(settings.dead_time_s, position)
        self.position = self.shaft = position
        self.speed = 0.0
        self.jammed = False

    @property
    def output(self) -> float:
        """Cable taken in [um]."""
        return self._settings.zero_error_um + (1.0 + self._settings.radius_error) * self.shaft

    def advance(self, setpoint: float, dt: float) -> None:
        """Follow a set-point [um] for ``dt`` [s].

        The wanted speed is error / lag, never more than what the drive can still brake from before the set-point,
        so that it does not overshoot.
        """
        if not dt > 0.0:
            return  # in no time nothing moves
        limits = self._settings
        setpoint = in_counts(self._arriving(setpoint, dt), limits.count_um)
        if self.jammed:
            self.speed = 0.0
            return
        error = setpoint - self.position
        size = abs(error)
        wanted = min(size / max(limits.lag_s, dt), limits.speed_um_s, braking_speed(size, limits, dt))
        change = limits.acceleration_um_s2 * dt
        wanted = math.copysign(wanted, error)
        self.speed = min(max(wanted, self.speed - change), self.speed + change)
        self.position += self.speed * dt
        half = 0.5 * limits.backlash_um
        self.shaft = min(max(self.shaft, self.position - half), self.position + half)


def in_counts(position: float, count: float) -> float:
    """Return a position in whole counts, both in one unit; as it is if ``count`` is 0."""
    return count * round(position / count) if count > 0.0 else position


def braking_speed(distance: float, limits: ServoSettings, dt: float) -> float:
    """Return largest speed from which a drive stops within a distance, when its speed changes once per ``dt`` only.

    Braking from (n + f) steps of speed, 0 <= f < 1, takes (n + 1) (n / 2 + f) steps of distance.
    """
    change = limits.acceleration_um_s2 * dt
    if math.isinf(change):
        return math.inf
    steps = distance / (change * dt)
    whole = math.floor(0.5 * (math.sqrt(1.0 + 8.0 * steps) - 1.0))
    return change * (whole + steps / (whole + 1) - 0.5 * whole)
