"""A PID controller of the end position; in an experiment: ``controller: {kind: ./pid.py:PID}``."""

from __future__ import annotations

import numpy as np

from tcrctl.extend import Array, Estimate, OwnControllerSection, Reference, Robot, quantity


class PidSettings(OwnControllerSection):
    """Drive speeds from the error of the end position, by the static map of the rest shape."""

    proportional_1_s: float = quantity("1/s", "part of the error that is removed per second", 1.0, ge=0)
    integral_1_s2: float = quantity("1/s2", "gain on the integrated error", 0.3, ge=0)
    derivative: float = quantity("1", "gain on the change of the error", 0.0, ge=0)


class Pid:
    """Removes the error of the end position, and follows the motion of the reference."""

    def __init__(self, settings: PidSettings, robot: Robot) -> None:
        self.settings = settings
        self.drives_per_metre = np.linalg.pinv(robot.rest_gain[:3], rcond=1e-2)
        self.sum, self.last = np.zeros(3), np.zeros(3)

    def control(self, estimate: Estimate, reference: Reference) -> Array:
        """Return drive speeds (m,) [m/s]; limits are kept by whoever calls."""
        s = self.settings
        error = reference.position - estimate.position
        self.sum += s.period_s * error
        rate, self.last = (error - self.last) / s.period_s, error
        motion = (reference.ahead_position[0] - reference.position) / s.period_s
        wanted = motion + s.proportional_1_s * error + s.integral_1_s2 * self.sum + s.derivative * rate
        speeds: Array = self.drives_per_metre @ wanted
        return speeds


PID = (PidSettings, Pid)
