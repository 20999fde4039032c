"""Instantaneous optimal control: predict, build (30), solve the LCP, refuse what is not solved.

target = reference + integral shift --------------+
estimate -> predictor -> affine prediction -------+-> optimum (build_ioc -> solve_ioc) -> first block -> plan
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from tcrctl.controller.cost import make_weights, wanted_tension
from tcrctl.controller.feedforward import reference_poses
from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.ioc import Solution, Weights
from tcrctl.controller.multi_step import MultiStep
from tcrctl.controller.one_step import OneStep
from tcrctl.controller.optimum import Demand, optimum
from tcrctl.controller.plan import Plan, Situation
from tcrctl.controller.predictor import Predictor
from tcrctl.controller.settings import IocSettings, shaken_speed_change
from tcrctl.controller.static import Static
from tcrctl.memory import SPEED, Kept
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Choice of predictor by the names of model and prediction; the settings type belongs to the latter.
PREDICTORS: Final[Mapping[tuple[str, str], Callable[[Any, float, Robot, float], Predictor]]] = {
    ("dynamic", "multi_step"): MultiStep,
    ("dynamic", "one_step"): OneStep,
    ("static", "multi_step"): Static,
}

#: Largest violation of the LCP conditions accepted; their rows are speeds [m/s] and tensions [N].
LCP_TOLERANCE: Final = 1e-6

#: Stands for the solution of a problem that was not even built.
NO_SOLUTION: Final = Solution(np.zeros(0), np.inf, 0, False, 0, np.zeros((0, 0)))


class InstantaneousOptimalControl:
    """See the module's docstring.

    Attributes:
        ahead: Prediction instants after the step (n,) [s].
        blocks: Number of input blocks.
    """

    extrapolates = anti_windup = True

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        """Take a ``controller:`` section and the robot."""
        self._settings, self._m = settings, robot.n_cables
        build = PREDICTORS[settings.model, settings.prediction.kind]
        self._predictor = build(settings.prediction, settings.period_s, robot, settings.drives.dead_time_s)
        self.ahead, self.blocks = self._predictor.grid.ahead, self._predictor.grid.blocks
        self._weights = make_weights(settings, robot.n_cables, self.ahead.size)
        self._shaken = shaken_speed_change(settings)
        self._needed, self._no_gain = np.zeros(robot.n_cables), np.zeros((6, robot.n_cables))
        self._tension = wanted_tension(settings)

    def sharpen(self) -> None:
        """Let the predictor solve to rounding."""
        self._predictor.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Return the speeds that the reference needed last, and what the predictor keeps."""
        return {"needed": Kept(self._needed, SPEED), **self._predictor.memory()}

    def inner_map(self) -> InnerMap | None:
        """Return Newton's iteration of the last prediction; the one LCP comes after it and is not fed back."""
        return self._predictor.inner_map()

    def plan(self, at: Situation) -> Plan:
        """Find the first block of the optimal inputs."""
        forecast = self._predictor.predict(at)
        solution, reason = NO_SOLUTION, at.doubt or ("" if forecast.converged else forecast.reason)
        if not reason:
            gain = self._no_gain if forecast.rest_gain is None else forecast.rest_gain
            weights, grid = self._cautious(at.dither.awake), self._predictor.grid
            solution, self._needed = optimum(forecast.prediction, gain, self._demand(at), grid, weights)
            reason = _doubt(solution)
        if reason:  # from standstill the speed that the reference needs is a free change
            self._needed = np.zeros(self._m)
        outputs = solution.outputs if solution.solved else forecast.prediction.free
        return Plan(
            speed=solution.inputs[: self._m],
            tension=outputs[-1, POSE_ROWS:].copy(),
            iterations=forecast.iterations,
            residual=forecast.residual,
            lcp_residual=solution.residual,
            lcp_pivots=solution.pivots,
            reason=reason,
            expected=None if reason else self._expected(at.outputs[:3], solution),
        )

    def _cautious(self, awake: float) -> Weights:
        """Return the weights, with the W of a dithered robot as far as the dither is awake."""
        if awake == 0.0:
            return self._weights
        calm = self._weights.speed_change
        return self._weights._replace(speed_change=calm + awake**2 * (self._shaken - calm))

    def _expected(self, now: Array, solution: Solution) -> Array:
        """Return the end position (3,) [m] one period from now, between now and the first instant."""
        expected: Array = now + (solution.outputs[0, :3] - now) * (self._settings.period_s / self.ahead[0])
        return expected

    def _demand(self, at: Situation) -> Demand:
        """Return what is wanted of the robot in a step."""
        poses = reference_poses(at.reference)
        return Demand(poses, at.shift, self._tension, at.previous, self._needed, at.low, at.high)


def _doubt(solution: Solution) -> str:
    """Return why a solution cannot be used; empty if it can."""
    if solution.rows == 0:
        return "the prediction is not finite"
    if not (solution.solved and solution.residual <= LCP_TOLERANCE):
        return f"the complementarity problem was not solved (residual {solution.residual:.2g})"
    return ""
