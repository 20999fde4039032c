"""What all controllers that feed the end pose back have in common, whatever finds their speeds.

reference, estimate -> pose error -> integral shift -+
estimate -> doubt, speed and stroke limits ----------+-> planner -> plan -> limits -> + dither -> limits -> command
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from tcrctl.controller.cost import input_limits, outputs, pose_error
from tcrctl.controller.dither import Dither
from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.plan import Planner, Situation
from tcrctl.controller.settings import IocSettings, KinematicSettings, shaken_integral, speed_limit
from tcrctl.memory import SPEED, Kept
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference

#: A reference that moves by less until the first instant ahead stands still [m].
STILL: Final = 1e-6


class Shell:
    """See the module's docstring. A step in doubt, or without a solution, holds the drives.

    Attributes:
        ahead: Instants after the step at which the planner wants the reference (n,) [s].
        dither: What is added to the planned speeds against friction.
    """

    ahead: Array

    def __init__(self, settings: IocSettings | KinematicSettings, robot: Robot, planner: Planner) -> None:
        """Put a planner into the shell."""
        self._settings = settings
        self._robot = robot
        self._planner = planner
        self._integral = IntegralAction(settings.integral, settings.period_s)
        self._shaken_integral = shaken_integral(settings)
        self._normal = robot.rest_normal if settings.output == "pose" else None
        self._speed = np.zeros(robot.n_cables)
        self._saturated = np.zeros(robot.n_cables, dtype=np.bool_)
        self.dither = Dither(settings.shaking, settings.period_s, robot, speed_limit(settings))
        self.ahead = planner.ahead

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Return the command for the coming period; the drives are held if no trustworthy one was found."""
        at = self._situation(estimate, reference)
        self.dither.observe(at.outputs[:3], estimate, settling=at.settling)
        plan = self._planner.plan(at)
        reason = at.doubt or plan.reason
        rests = bool(reason) or at.settling
        self._speed = np.zeros(self._robot.n_cables) if rests else at.within(plan.speed)
        self.dither.expect(None if rests else plan.expected)
        speed = self._speed if reason else self._shaken(estimate, rests=rests)
        limit = speed_limit(self._settings) - at.dither.fastest
        self._saturated = np.abs(self._speed) >= limit * (1.0 - 1e-9)
        info = ControlInfo(
            converged=not reason,
            iterations=plan.iterations,
            residual=plan.residual,
            lcp_residual=plan.lcp_residual,
            lcp_pivots=plan.lcp_pivots,
            saturated=self._saturated,
            predicted_tension=plan.tension,
            integral=at.shift,
            reason=reason,
        )
        return Command(speed, estimate.drive + self._settings.period_s * speed), info

    def _shaken(self, estimate: Estimate, *, rests: bool) -> Array:
        """Return the planned speeds with those of the dither, within all limits (m,) [m/s].

        Planned ones are within them already, but not the zeros of a robot at rest with a drive outside its stroke.
        """
        if not self.dither.runs:
            return self._speed
        if self.dither.sleeps and not rests:
            self.dither.sleep()
            return self._speed
        low, high = input_limits(self._settings, self._robot, estimate.drive, 1)
        return np.asarray(np.minimum(np.maximum(self._speed + self.dither.speed(), low), high))

    def _situation(self, estimate: Estimate, reference: Reference) -> Situation:
        """Move the integral action on, and gather what the planner is told."""
        planner = self._planner
        age = reference.t - estimate.t if planner.extrapolates else 0.0
        now = outputs(estimate, age, self._robot)
        error = pose_error(reference, now[:3], now[3:6])
        self._normal = now[3:6].copy() if self._settings.output == "pose" else None
        settling = reference.t < self._settings.settling and _rests(reference)
        stands = settling or (planner.anti_windup and bool(np.count_nonzero(self._saturated)))
        dither = self.dither.now
        gain = 1.0 + dither.awake * (self._shaken_integral - 1.0)
        shift = self._integral.update(error, stands, gain)
        low, high = input_limits(
            self._settings, self._robot, estimate.drive, planner.blocks, reserve=dither.fastest
        )
        return Situation(
            estimate=estimate,
            reference=reference,
            age=age,
            outputs=now,
            error=error,
            shift=shift,
            previous=self._speed,
            low=low,
            high=high,
            doubt=_doubt(estimate),
            dither=dither,
            settling=settling,
        )

    def sharpen(self) -> None:
        """Let the planner solve to rounding, and the dither stand still."""
        self.dither.stand_still()
        self._planner.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Return the last planned input, the integral action, and what dither and planner keep."""
        return {
            "speed": Kept(self._speed, SPEED),
            **self._integral.memory(self._normal),
            **self.dither.memory(),
            **self._planner.memory(),
        }

    def inner_map(self) -> InnerMap | None:
        """Return the planner's iteration."""
        return self._planner.inner_map()


def _rests(reference: Reference) -> bool:
    """Return whether the reference stands still for the first instant that the planner looks at."""
    ahead = reference.ahead_position
    return ahead is None or bool(np.abs(ahead[0] - reference.position).max() < STILL)


def _doubt(estimate: Estimate) -> str:
    """Return why no command can be built on an estimate; empty if one can."""
    if not estimate.converged:
        return "the estimator's step did not converge"
    if not math.isfinite(estimate.q.sum()):
        return "the estimate is not finite"
    return ""
