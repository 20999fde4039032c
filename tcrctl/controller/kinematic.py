"""``kind: kinematic``: resolved motion rate control with the static map, a baseline to compare with [WH69].

    J = ∂h/∂q ∂q_eq/∂d          static map of the model at the present drives
    u = J⁺ (dy_d/dt + k (y_d + shift - y)) + Z z

J⁺ is the damped pseudo-inverse [NH86], positions in m and normals times a lever. Z spans the drives that leave the
end where it is; z moves the model's tensions towards a reference. There is no horizon, no cost and no inertia: the
lightly damped slow modes, which the map does not know, bound the gain k at about 1 1/s.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.cost import input_limits, pose_error
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.multi_step import TOLERANCE, follow
from tcrctl.controller.settings import KinematicSettings, SlackGuard
from tcrctl.controller.static import rest_map, static_outputs
from tcrctl.memory import Kept
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import TOLERANCE as SHARP
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.potential import Outcome
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference

#: Directions of the drives that move the end less than this part of the strongest one count as free.
RANK = 2e-3


def resolved_rates(J: Array, rate: Array, damping: float) -> Array:
    """Drive speeds (m,) that move the end at ``rate`` (r,): u = J'(J J' + μ² I)⁻¹ rate [NH86].

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
    """Drive speeds (m,) that leave the end where it is and change the tensions as nearly as they can.

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
    """

    def __init__(self, settings: KinematicSettings, robot: Robot) -> None:
        self._settings, self._robot = settings, robot
        rows = 6 if settings.output == "pose" else 3
        self._scale = np.array([1.0] * 3 + [settings.lever_mm / 1000.0] * 3)[:rows]
        self._work, self._load = make_workspace(robot.model), static_load(robot.model, robot.weight)
        self._at = rest_map(robot)
        self._integral = IntegralAction(settings.integral, settings.period_s)
        self._solved, self._tolerance = False, TOLERANCE
        self._normal = robot.rest_normal if settings.output == "pose" else None
        self._saturated = np.zeros(robot.n_cables, dtype=np.bool_)
        self.ahead = np.array([settings.period_s])

    def sharpen(self) -> None:
        """See :class:`tcrctl.controller.controller.Controller`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Integral action."""
        return self._integral.memory(self._normal)

    def inner_map(self) -> InnerMap | None:
        """Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics", self._at
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Command for the coming period; the drives are held if the static map is not known."""
        h, robot = self._settings.period_s, self._robot
        error = pose_error(reference, estimate.position, estimate.normal)
        self._normal = estimate.normal if self._settings.output == "pose" else None
        shift = self._integral.update(error, bool(self._saturated.any()))
        good, reason = Outcome(False, 0, np.inf, 0.0), "the estimate is not usable"
        tension, gain = estimate.tension, np.zeros((POSE_ROWS + robot.n_cables, robot.n_cables))
        if estimate.converged and np.isfinite(estimate.q).all():
            at = self._at
            good = Outcome(*follow(robot.model, self._load, self._work, *at, estimate.drive, self._tolerance))
            reason = "" if good.converged else "the model has no stable equilibrium at the present drives"
        self._solved = good.converged
        if not reason:
            rest, gain = static_outputs(robot.model, self._work, self._at, robot.tip)
            tension = rest[POSE_ROWS:]
        wanted = np.zeros(robot.n_cables) if reason else self._rates(reference, error + shift, tension, gain)
        speed = self._within_limits(wanted, estimate.drive)
        self._saturated = np.abs(speed) >= (1.0 - 1e-9) * self._settings.speed_limit_mm_s / 1000.0
        info = ControlInfo(
            converged=not reason,
            iterations=good.iterations,
            residual=good.residual,
            lcp_residual=0.0,
            lcp_pivots=0,
            saturated=self._saturated,
            predicted_tension=tension + h * (gain[POSE_ROWS:] @ speed),
            integral=shift,
            reason=reason,
        )
        return Command(speed, estimate.drive + h * speed), info

    def _rates(self, reference: Reference, error: Array, tension: Array, gain: Array) -> Array:
        """Drive speeds before the limits (m,) [m/s]."""
        ahead = None if reference.ahead_normal is None else reference.ahead_normal[0]
        before = np.zeros(3) if reference.normal is None else reference.normal
        turn = np.zeros(3) if ahead is None else ahead - before
        move = np.concatenate([reference.ahead_position[0] - reference.position, turn])
        rate = move / self._settings.period_s + self._settings.gain_1_s * error
        rows = self._scale.shape[0]
        J = self._scale[:, None] * gain[:rows]
        speed = resolved_rates(J, self._scale * rate[:rows], self._settings.damping)
        guard: SlackGuard | None = self._settings.tension
        if guard is not None:
            speed = speed + free_rates(J, gain[POSE_ROWS:], guard.gain_1_s * (guard.reference_n - tension))
        return speed

    def _within_limits(self, speed: Array, drive: Array) -> Array:
        """Shorten to the speed limit, which keeps the direction, and stop drives at the ends of their stroke."""
        fastest = float(np.max(np.abs(speed)))
        limit = self._settings.speed_limit_mm_s / 1000.0
        low, high = input_limits(self._settings, self._robot, drive, 1)
        kept: Array = np.clip(speed * min(1.0, limit / fastest) if fastest > 0.0 else speed, low, high)
        return kept
