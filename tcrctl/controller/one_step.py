"""One-step prediction: a single backward-Euler step as long as the horizon, with the last input held.

The step minimises the incremental potential, so it converges from any state; the prediction is linearised at its
end. Backward Euler over a long step damps the slow modes, which makes this prediction sluggish but very tame.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.blocks import make_grid
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.prediction_settings import OneStepSettings
from tcrctl.controller.predictor import Forecast
from tcrctl.memory import Kept
from tcrctl.robot import dynamics, linear, pose
from tcrctl.robot.equations import FORCE, Q_FREE, Load, make_workspace
from tcrctl.robot.module import FIXED
from tcrctl.robot.potential import minimise
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.robot.statics import SHARP, TOLERANCE
from tcrctl.signals import Array, Estimate

MAX_ITERATIONS = 60


class OneStep:
    """See the module's docstring."""

    def __init__(self, settings: OneStepSettings, period: float, robot: Robot) -> None:
        """Take a ``prediction:`` section and the robot; the control ``period`` [s] does not matter."""
        del period
        self._robot, self._horizon = robot, settings.horizon_s
        self.grid = make_grid(1, 1, settings.horizon_s)
        self._work = make_workspace(robot.model)
        self._scratch = dynamics.make_scratch(robot.model)
        self._gain = np.zeros((self._work.r.shape[0], robot.n_cables))
        self._column = np.zeros(self._work.r.shape[0])
        self._tolerance = TOLERANCE
        self._last: tuple[Load, Array] | None = None
        self._guess = robot.rest.q.copy()

    def sharpen(self) -> None:
        """See :class:`tcrctl.controller.inner_map.Linearisable`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Return nothing: the guess is where the iteration starts, not where it ends."""
        return {}

    def inner_map(self) -> InnerMap | None:
        """Return Newton's iteration of the backward-Euler step with the last input held."""
        what = "Newton on the backward-Euler step; one LCP after it, not fed back"
        return None if self._last is None else newton_map(what, self._robot, *self._last, self._guess)

    def _load(self, q: Array, v: Array, drive: Array) -> Load:
        """Return the load of backward Euler over the horizon from (q, v, d)."""
        horizon, s = self._horizon, self._scratch
        inertia = 1.0 / horizon**2 + self._robot.model.damping / horizon
        s.nodal[Q_FREE] = q + v / (horizon * inertia)
        s.nodal[FORCE] = self._robot.weight
        dynamics.lengths_before(self._robot.model, q, v, drive, np.zeros_like(drive), 0.0, s, self._work)
        return Load(inertia, 1.0 / horizon, s.nodal, s.bar_before, s.cable_before, None)

    def predict(self, estimate: Estimate, age: float, outputs: Array, speed: Array) -> Forecast:
        """See :class:`Predictor`."""
        del outputs  # the step predicts outputs from the state itself
        horizon = self._horizon
        m = speed.shape[0]
        tip = self._robot.tip
        load = self._load(estimate.q + age * estimate.v, estimate.v, estimate.drive)
        q = self._guess.copy()
        drive = estimate.drive + horizon * speed
        outcome = minimise(
            self._robot.model, q, drive, load, self._work, self._tolerance, MAX_ITERATIONS, True
        )
        self._last = (load, drive) if outcome.converged else None
        if outcome.converged:
            self._guess = q
        linear.solve(self._work, self._work.r, self._column)
        linear.drive_gain(self._work, self._gain)
        first = 3 * (tip - FIXED)
        gain = np.empty((1, POSE_ROWS + m, m))
        gain[0, :POSE_ROWS] = horizon * (pose.output_matrix(q, tip) @ self._gain[first : first + 9])
        gain[0, POSE_ROWS:] = horizon * linear.tension_gain(self._work, self._gain)
        free = np.concatenate(
            [pose.position(q, tip), pose.normal(q, tip), [pose.twist(q, tip)], self._work.tension]
        )
        free = free - gain[0] @ speed
        reason = "" if outcome.converged else "the backward-Euler prediction did not converge"
        return Forecast(
            Prediction(free[None], gain), outcome.converged, outcome.iterations, outcome.residual, reason
        )
