"""Algorithm 1 as printed (with the corrections of REFERENCES.md): one generalized-alpha step of one period.

Positions and inputs are iterated together, (28): linearise the step at z^(j), solve the LCP for u, take the
full Newton step. It is kept to show what the multi-step controller is for: in one period the soft modes do not
answer, so the algorithm misjudges its authority.
"""

from __future__ import annotations

import numpy as np

from tcrctl.controller.cost import input_limits, make_target, make_weights, pose_error
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.ioc import Prediction, Solution, build_ioc, solve_ioc
from tcrctl.controller.settings import IocSettings
from tcrctl.numerics.generalized_alpha import coefficients
from tcrctl.robot import dynamics, linear, pose
from tcrctl.robot.equations import FORCE, Q_FREE, Load, assemble, make_workspace
from tcrctl.robot.model import FIXED
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference

#: Convergence error ε of (41) and spectral radius ρ of (15), the paper's values.
EPSILON = 2e-6
RHO = 0.8
MAX_ITERATIONS = 30


class LiteralIoc:
    """Algorithm 1. State: last input.

    Attributes:
        ahead: The one prediction instant (1,) [s].
    """

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._settings, self._robot = settings, robot
        self._weights = make_weights(settings, robot.n_cables, 1)
        self._integral = IntegralAction(settings.integral, settings.period_s)
        self._work, self._scratch = make_workspace(robot.model), dynamics.make_scratch(robot.model)
        self._gain = np.zeros((self._work.r.shape[0], robot.n_cables))
        self._speed = np.zeros(robot.n_cables)
        self.ahead = np.array([settings.period_s])

    def _load(self, estimate: Estimate, v: Array) -> tuple[Array, Load]:
        """Predictor positions and load of the step (12)-(14) with zero acceleration at its start."""
        h, s, robot = self._settings.period_s, self._scratch, self._robot
        c = coefficients(RHO, h)
        inertia = c.acceleration + robot.model.damping * c.velocity
        q0 = estimate.q + h * v
        s.nodal[Q_FREE] = q0 - robot.model.damping * v / inertia
        s.nodal[FORCE] = robot.weight
        dynamics.lengths_before(
            robot.model, estimate.q, v, estimate.drive, self._speed, 0.5 * h, s, self._work
        )
        return q0, Load(inertia, 2.0 / h, s.nodal, s.bar_before, s.cable_before)

    def _linearise(self, q: Array, drive: Array, load: Load, speed: Array) -> tuple[Array, Prediction]:
        """Newton step (12 n_modules,) at the present input, and the outputs as (31)."""
        h, tip, ws = self._settings.period_s, self._robot.tip, self._work
        assemble(self._robot.model, q, drive, load, ws, True)
        linear.factor_shifted(ws.K, ws.U)
        step = np.zeros(ws.r.shape[0])
        linear.solve(ws, -ws.r, step)
        linear.drive_gain(ws, self._gain)
        first, m = 3 * (tip - FIXED), speed.shape[0]
        C = pose.output_matrix(q, tip)
        gain = np.empty((1, POSE_ROWS + m, m))
        gain[0, :POSE_ROWS] = h * (C @ self._gain[first : first + 9])
        gain[0, POSE_ROWS:] = h * linear.tension_gain(ws, self._gain)
        now = np.concatenate([pose.position(q, tip), pose.normal(q, tip), [pose.twist(q, tip)], ws.tension])
        now[:POSE_ROWS] += C @ step[first : first + 9]
        now[POSE_ROWS:] += ws.axial * (ws.G[:, 3 * FIXED :] @ step)
        return step, Prediction((now - gain[0] @ speed)[None], gain)

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Command for the coming period; the drives are held if (41) was not reached."""
        h, m = self._settings.period_s, self._robot.n_cables
        error = pose_error(reference, estimate.position, estimate.normal)
        target = make_target(self._settings, reference, self._integral.update(error, False), m)
        low, high = input_limits(self._settings, self._robot, estimate.drive, 1)
        q, load = self._load(estimate, estimate.v)
        speed, change, iteration = self._speed, np.inf, 0
        solution = Solution(speed, np.inf, 0, False, 0)
        while change > EPSILON and iteration < MAX_ITERATIONS and np.all(np.isfinite(q)):
            step, prediction = self._linearise(q, estimate.drive + h * speed, load, speed)
            problem = build_ioc(prediction, target, self._speed, low, high, self._weights)
            solution = Solution(*solve_ioc(problem, prediction, self._weights))
            moved = step + h * (self._gain @ (solution.inputs - speed))
            q[3 * FIXED :] += moved
            speed, iteration = solution.inputs, iteration + 1
            change = float(np.linalg.norm(moved) / np.linalg.norm(q))
        good = change <= EPSILON and solution.solved and estimate.converged
        self._speed = np.clip(speed, low, high) if good else np.zeros(m)
        info = ControlInfo(
            converged=good,
            iterations=iteration,
            residual=float(np.max(np.abs(self._work.r))),
            lcp_residual=solution.residual,
            lcp_pivots=solution.pivots,
            saturated=np.abs(self._speed) >= (1.0 - 1e-9) * self._settings.speed_limit_mm_s / 1000.0,
            predicted_tension=self._work.tension.copy(),
            integral=self._integral.shift,
            reason=""
            if good
            else f"(41) was not reached: |dz|/|z| = {change:.2g} after {iteration} iterations",
        )
        return Command(self._speed, estimate.drive + h * self._speed), info
