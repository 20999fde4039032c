"""Instantaneous optimal controller: predict, build (30), solve the LCP, check, command.

reference, estimate -> integral shift -> target --+
estimate -> predictor -> affine prediction -------+-> build_ioc -> solve_ioc -> first block -> command
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from tcrctl.controller.cost import input_limits, make_target, make_weights, outputs, pose_error
from tcrctl.controller.feedforward import needed_speeds, reference_poses, wanted_changes
from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.ioc import Solution, build_ioc, solve_ioc
from tcrctl.controller.multi_step import MultiStep
from tcrctl.controller.one_step import OneStep
from tcrctl.controller.predictor import Forecast, Predictor
from tcrctl.controller.settings import IocSettings
from tcrctl.controller.static import Static
from tcrctl.memory import SPEED, Kept
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference

#: Choice of prediction by the names of model and prediction.
PREDICTORS: Mapping[tuple[str, str], Callable[[IocSettings, Robot], Predictor]] = {
    ("dynamic", "multi_step"): MultiStep,
    ("dynamic", "one_step"): OneStep,
    ("static", "multi_step"): Static,
}

#: Largest violation of the LCP conditions accepted; their rows are speeds [m/s] and tensions [N].
LCP_TOLERANCE = 1e-6

#: Stands for the solution of a problem that was not even built.
NO_SOLUTION = Solution(np.zeros(0), np.inf, 0, False, 0)


class InstantaneousOptimalControl:
    """See the module's docstring.

    Attributes:
        ahead: Prediction instants after the step (n,) [s].
    """

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._settings, self._robot = settings, robot
        self._predictor = PREDICTORS[settings.model, settings.prediction](settings, robot)
        self._weights = make_weights(settings, robot.n_cables, self._predictor.ahead.size)
        self._integral = IntegralAction(settings.integral, settings.period_s)
        self._normal = robot.rest_normal if settings.output == "pose" else None
        self._speed, self._needed = np.zeros(robot.n_cables), np.zeros(robot.n_cables)
        self._saturated = np.zeros(robot.n_cables, dtype=np.bool_)
        self.ahead = self._predictor.ahead

    def sharpen(self) -> None:
        """Let the predictor solve to rounding."""
        self._predictor.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Last input, integral action, and what the predictor keeps."""
        return {
            "speed": Kept(self._speed, SPEED),
            "needed": Kept(self._needed, SPEED),
            **self._integral.memory(self._normal),
            **self._predictor.memory(),
        }

    def inner_map(self) -> InnerMap | None:
        """Newton's iteration of the last prediction; the one LCP comes after it and is not fed back."""
        return self._predictor.inner_map()

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Command for the coming period; the drives are held if no trustworthy one was found."""
        age = reference.t - estimate.t
        now = outputs(estimate, age, self._robot)
        error = pose_error(reference, now[:3], now[3:6])
        self._normal = now[3:6].copy() if self._settings.output == "pose" else None
        shift = self._integral.update(error, bool(self._saturated.any()))
        forecast = self._predictor.predict(estimate, age, now, self._speed)
        low, high = input_limits(self._settings, self._robot, estimate.drive, self._predictor.blocks)
        solution = NO_SOLUTION
        reason = _doubt(estimate, forecast)
        if not reason:
            target = make_target(self._settings, reference, shift, self._robot.n_cables)
            changes = self._free_changes(forecast, reference)
            problem = build_ioc(forecast.prediction, target, changes, low, high, self._weights)
            solution = Solution(*solve_ioc(problem, forecast.prediction, self._weights))
            if not (solution.solved and solution.residual <= LCP_TOLERANCE):
                reason = f"the complementarity problem was not solved (residual {solution.residual:.2g})"
        m = self._robot.n_cables
        self._speed = (
            np.zeros(m) if reason else np.minimum(np.maximum(solution.inputs[:m], low[:m]), high[:m])
        )
        if reason:  # from standstill the speed that the reference needs is a free change
            self._needed = np.zeros(m)
        limit = self._settings.speed_limit_mm_s / 1000.0
        self._saturated = np.abs(self._speed) >= limit * (1.0 - 1e-9)
        info = ControlInfo(
            converged=not reason,
            iterations=forecast.iterations,
            residual=forecast.residual,
            lcp_residual=solution.residual,
            lcp_pivots=solution.pivots,
            saturated=self._saturated,
            predicted_tension=_last_tension(forecast, solution),
            integral=shift,
            reason=reason,
        )
        return Command(self._speed, estimate.drive + self._settings.period_s * self._speed), info

    def _free_changes(self, forecast: Forecast, reference: Reference) -> Array:
        """Changes of speed that cost nothing (blocks * m,) [m/s]; see :mod:`tcrctl.controller.feedforward`."""
        blocks, m = self._predictor.blocks, self._robot.n_cables
        needed = np.zeros((blocks, m))
        if self._settings.feedforward and forecast.rest_gain is not None:
            weights, poses = self._weights.output[:6], reference_poses(reference)
            needed = needed_speeds(forecast.rest_gain, weights, poses, self._predictor.edges, self.ahead[0])
        changes = wanted_changes(self._speed, self._needed, needed)
        self._needed = needed[0].copy()
        return changes


def _doubt(estimate: Estimate, forecast: Forecast) -> str:
    """Empty, or why no command can be built on this step."""
    if not estimate.converged:
        return "the estimator's step did not converge"
    if not np.isfinite(estimate.q).all():
        return "the estimate is not finite"
    if not forecast.converged:
        return forecast.reason
    if not (np.isfinite(forecast.prediction.free).all() and np.isfinite(forecast.prediction.gain).all()):
        return "the prediction is not finite"
    return ""


def _last_tension(forecast: Forecast, solution: Solution) -> Array:
    """Predicted tensions at the end of the horizon (m,) [N]; those without any input if there is none."""
    free, gain = forecast.prediction
    if not solution.solved:
        return free[-1, POSE_ROWS:].copy()
    predicted: Array = free[-1, POSE_ROWS:] + gain[-1, POSE_ROWS:] @ solution.inputs
    return predicted
