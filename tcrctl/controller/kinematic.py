"""``kind: kinematic``: resolved motion rate control with the static map, a baseline to compare with [WH69].

    J = ∂y/∂q ∂q_eq/∂d          static map of the model at the present drives
    u = J⁺ (dy_d/dt + k (y_d + shift - y)) + Z z

J⁺ is the damped pseudo-inverse [NH86], positions in m and normals times a lever. Z spans the drives that leave the
end where it is; z moves the model's tensions towards a reference. There is no horizon, no cost and no inertia: the
lightly damped slow modes, which the map does not know, bound the gain k at about 1 1/s.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.plan import Plan, Situation
from tcrctl.controller.settings import KinematicSettings, SlackGuard
from tcrctl.memory import Kept
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.robot.statics import SHARP, TOLERANCE, follow, rest_map, static_outputs
from tcrctl.signals import Array

#: Directions of the drives that move the end less than this part of the strongest one count as free.
RANK = 2e-3


def resolved_rates(J: Array, rate: Array, damping: float) -> Array:
    """Return drive speeds (m,) that move the end at ``rate`` (r,): u = J'(J J' + μ² I)⁻¹ rate [NH86].

    Args:
        J: Derivatives of the outputs by the drives (r, m).
        rate: Speeds of the outputs wanted (r,).
        damping: μ; 0 gives the smallest speeds that do it best.
    """
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    kept = s > RANK * s[0]
    inverse = np.where(kept, s / (s**2 + damping**2 + (~kept)), 0.0)
    speed: Array = Vt.T @ (inverse * (U.T @ rate))
    return speed


def free_rates(J: Array, T: Array, rate: Array) -> Array:
    """Return drive speeds (m,) that leave the end where it is and change the tensions as nearly as they can.

    Args:
        J: Derivatives of the outputs by the drives (r, m).
        T: Derivatives of the tensions by the drives (m, m) [N/m].
        rate: Speeds of the tensions wanted (m,) [N/s].
    """
    _, s, Vt = np.linalg.svd(J)
    Z = Vt[int(np.count_nonzero(s > RANK * s[0])) :].T
    if not Z.size:
        return np.zeros(J.shape[1])
    speed: Array = Z @ np.linalg.lstsq(T @ Z, rate, rcond=None)[0]
    return speed


class Kinematic:
    """See the module's docstring.

    Attributes:
        ahead: The end of the coming period (1,) [s].
        blocks: One block of inputs.
    """

    extrapolates, anti_windup = False, True

    def __init__(self, settings: KinematicSettings, robot: Robot) -> None:
        """Take a ``controller:`` section and the robot."""
        self._settings, self._robot = settings, robot
        rows = 6 if settings.output == "pose" else 3
        self._scale = np.array([1.0] * 3 + [settings.lever_mm / 1000.0] * 3)[:rows]
        self._work = make_workspace(robot.model)
        self._load = static_load(robot.model, robot.weight)
        self._at = rest_map(robot)
        self._solved, self._tolerance = False, TOLERANCE
        self.ahead, self.blocks = np.array([settings.period_s]), 1

    def sharpen(self) -> None:
        """See :class:`tcrctl.controller.inner_map.Linearisable`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Return nothing: the static map is where the iteration starts, not where it ends."""
        return {}

    def inner_map(self) -> InnerMap | None:
        """Return Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics", self._at
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def plan(self, at: Situation) -> Plan:
        """Find the speeds that move the end as wanted, by the static map at the present drives."""
        robot = self._robot
        drive = at.estimate.drive
        tension = at.estimate.tension
        self._solved = False
        if at.doubt:
            return Plan(np.zeros_like(drive), tension, 0, np.inf)
        found = follow(robot.model, self._load, self._work, self._at, drive, self._tolerance)
        self._solved = found.converged
        if not found.converged:
            reason = "the model has no stable equilibrium at the present drives"
            return Plan(np.zeros_like(drive), tension, found.iterations, found.residual, reason=reason)
        rest, gain = static_outputs(robot.model, self._work, self._at, robot.tip)
        speed = at.within(_shortened(self._rates(at, rest[POSE_ROWS:], gain), float(np.max(at.high))))
        tension = rest[POSE_ROWS:] + self._settings.period_s * (gain[POSE_ROWS:] @ speed)
        return Plan(speed, tension, found.iterations, found.residual)

    def _rates(self, at: Situation, tension: Array, gain: Array) -> Array:
        """Return drive speeds before the limits (m,) [m/s] from tensions (m,) [N] and static gain (7 + m, m)."""
        reference = at.reference
        ahead = None if reference.ahead_normal is None else reference.ahead_normal[0]
        before = np.zeros(3) if reference.normal is None else reference.normal
        turn = np.zeros(3) if ahead is None else ahead - before
        move = np.concatenate([reference.ahead_position[0] - reference.position, turn])
        rate = move / self._settings.period_s + self._settings.gain_1_s * (at.error + at.shift)
        rows = self._scale.shape[0]
        J = self._scale[:, None] * gain[:rows]
        speed = resolved_rates(J, self._scale * rate[:rows], self._settings.damping)
        guard: SlackGuard | None = self._settings.tension
        if guard is not None:
            speed = speed + free_rates(J, gain[POSE_ROWS:], guard.gain_1_s * (guard.reference_n - tension))
        return speed


def _shortened(speed: Array, limit: float) -> Array:
    """Return the speeds (m,) shortened to the speed limit, both [m/s], which keeps their direction."""
    fastest = float(np.max(np.abs(speed)))
    return speed * min(1.0, limit / fastest) if fastest > 0.0 else speed
