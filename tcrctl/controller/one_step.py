"""One-step prediction: a single backward-Euler step as long as the horizon, with the last input held.

The step minimises the incremental potential, so it converges from any state; the prediction is linearised at its
end. Backward Euler over a long step damps the slow modes, which makes this prediction sluggish but very tame.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.blocks import block_edges
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.predictor import Forecast
from tcrctl.controller.settings import IocSettings
from tcrctl.memory import Kept
from tcrctl.robot import dynamics, linear, pose
from tcrctl.robot.equations import FORCE, Q_FREE, Load, make_workspace
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Estimate

TOLERANCE = 1e-5
#: Where the tolerance itself must not show.
SHARP = 1e-7
MAX_ITERATIONS = 60


class OneStep:
    """See the module's docstring."""

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._robot, self._horizon = robot, settings.horizon_s
        self.ahead: Array = np.array([settings.horizon_s])
        self.blocks, self.edges = 1, block_edges(1, 1)
        self._work, self._scratch = make_workspace(robot.model), dynamics.make_scratch(robot.model)
        self._gain = np.zeros((self._work.r.shape[0], robot.n_cables))
        self._column = np.zeros(self._work.r.shape[0])
        self._tolerance = TOLERANCE
        self._last: tuple[Load, Array] | None = None
        self._guess = robot.rest.q.copy()

    def sharpen(self) -> None:
        """See :class:`Predictor`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Nothing: the guess is where the iteration starts, not where it ends."""
        return {}

    def inner_map(self) -> InnerMap | None:
        """Newton's iteration of the backward-Euler step with the last input held."""
        what = "Newton on the backward-Euler step; one LCP after it, not fed back"
        return None if self._last is None else newton_map(what, self._robot, *self._last, self._guess)

    def _load(self, q: Array, v: Array, drive: Array) -> Load:
        """Backward Euler over the horizon from (q, v, d)."""
        h, s = self._horizon, self._scratch
        inertia = 1.0 / h**2 + self._robot.model.damping / h
        s.nodal[Q_FREE] = q + v / (h * inertia)
        s.nodal[FORCE] = self._robot.weight
        dynamics.lengths_before(self._robot.model, q, v, drive, np.zeros_like(drive), 0.0, s, self._work)
        return Load(inertia, 1.0 / h, s.nodal, s.bar_before, s.cable_before, None)

    def predict(self, estimate: Estimate, age: float, now: Array, speed: Array) -> Forecast:
        """See :class:`Predictor`."""
        del now  # the step predicts outputs from the state itself
        h, m, tip = self._horizon, speed.shape[0], self._robot.tip
        load = self._load(estimate.q + age * estimate.v, estimate.v, estimate.drive)
        q = self._guess.copy()
        drive = estimate.drive + h * speed
        outcome = Outcome(
            *minimise(self._robot.model, q, drive, load, self._work, self._tolerance, MAX_ITERATIONS, True)
        )
        self._last = (load, drive) if outcome.converged else None
        if outcome.converged:
            self._guess = q
        linear.solve(self._work, self._work.r, self._column)
        linear.drive_gain(self._work, self._gain)
        first = 3 * tip - 12
        gain = np.empty((1, POSE_ROWS + m, m))
        gain[0, :POSE_ROWS] = h * (pose.output_matrix(q, tip) @ self._gain[first : first + 9])
        gain[0, POSE_ROWS:] = h * linear.tension_gain(self._work, self._gain)
        free = np.concatenate(
            [pose.position(q, tip), pose.normal(q, tip), [pose.twist(q, tip)], self._work.tension]
        )
        free = free - gain[0] @ speed
        reason = "" if outcome.converged else "the backward-Euler prediction did not converge"
        return Forecast(
            Prediction(free[None], gain), outcome.converged, outcome.iterations, outcome.residual, reason
        )
