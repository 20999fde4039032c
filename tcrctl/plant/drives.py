"""Drives of the simulated plant: what the controller asks for, what the cables get, what is reported.

Between two internal steps a set-point is a straight line, s(t) = s_0 + v t. A position loop of time constant τ that
follows it from x_0 is after an internal step h at

    x = x_0 + h / σ (S - x_0),    σ = h / (1 - e^(-h/τ)),    S = s_0 + v (σ - τ)

the same as if it had followed the constant S with the lag σ of a loop that is sampled once per h. So the lag of a
drive does not depend on the step.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tcr_hardware.servo import Servo, ServoSettings, in_counts
from tcrctl.plant.reality_settings import DriveSettings
from tcrctl.signals import Array

#: Micrometres per metre.
UM = 1e6


def servo_settings(settings: DriveSettings, count: int) -> tuple[ServoSettings, ...]:
    """Return the behaviour of so many drives, one per cable."""
    limit = settings.acceleration_limit_mm_s2
    alike = ServoSettings(
        lag_s=settings.lag_s,
        acceleration_um_s2=math.inf if limit is None else 1e3 * limit,
        backlash_um=1e3 * settings.backlash_mm,
        dead_time_s=settings.dead_time_s,
        count_um=1e3 * settings.quantisation_mm,
    )
    radius = np.broadcast_to(settings.radius_error, count).tolist()
    zero = np.broadcast_to(settings.zero_error_mm, count).tolist()
    return tuple(
        replace(alike, radius_error=r, zero_error_um=1e3 * z) for r, z in zip(radius, zero, strict=True)
    )


class SimulatedDrives:
    """One servo per cable.

    Attributes:
        set_point: Where the drives shall be (m,) [m].
    """

    def __init__(self, settings: DriveSettings, start: Array, h: float) -> None:
        """Rest at drive lengths ``start`` (m,) [m], to be moved in internal steps of ``h`` [s]."""
        self._settings = settings
        lag = settings.lag_s
        keep = math.exp(-h / settings.lag_s) if settings.lag_s > 0.0 else 0.0
        sampled = h / (1.0 - keep)
        self._h, self._ahead = h, sampled - lag
        self._servos = [
            Servo(
                replace(servo, lag_s=sampled, speed_um_s=math.inf),
                in_counts(UM * float(start[c]), servo.count_um),
            )
            for c, servo in enumerate(servo_settings(settings, start.size))
        ]
        self.set_point = np.array([servo.position for servo in self._servos]) / UM

    def cable(self) -> Array:
        """Return the cable that is really taken in (m,) [m]."""
        return np.array([servo.output for servo in self._servos]) / UM

    def reported(self) -> Array:
        """Return what the drives report (m,) [m]."""
        if self._settings.reports == "set_point":
            return self.set_point.copy()
        count = 1e3 * self._settings.quantisation_mm
        return np.array([in_counts(servo.position, count) for servo in self._servos]) / UM

    def move(self, speed: Array) -> Array:
        """Let the set-points move at ``speed`` (m,) [m/s] for one internal step; return what that takes in [m]."""
        followed = self.set_point + speed * self._ahead
        self.set_point = self.set_point + speed * self._h
        for servo, target in zip(self._servos, (UM * followed).tolist(), strict=True):
            servo.advance(target, self._h)
        return self.cable()
