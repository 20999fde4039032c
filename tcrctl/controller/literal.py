"""Algorithm 1 as printed (with the corrections of REFERENCES.md): one generalized-alpha step of one period.

With ``model: static`` the first equation of (9) is degraded to its static form, as in Sec. V.E: the same iteration
then finds an equilibrium, and nothing but the drives and the last input is left of the state.

Positions and inputs are iterated together, (28): linearise the step at z^(j), solve the LCP for u, take the
full Newton step. It is kept to show what the multi-step controller is for: in one period the soft modes do not
answer, so the algorithm misjudges its authority.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tcrctl.controller.cost import input_limits, make_target, make_weights, pose_error
from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.ioc import Prediction, Solution, build_ioc, solve_ioc
from tcrctl.controller.settings import IocSettings
from tcrctl.memory import POSITION, SPEED, Kept
from tcrctl.numerics.generalized_alpha import coefficients
from tcrctl.robot import dynamics, linear, pose
from tcrctl.robot.equations import FORCE, Q_FREE, Load, assemble, make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import FIXED
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference

#: Convergence error ε of (41) and spectral radius ρ of (15), the paper's values.
EPSILON = 2e-6
RHO = 0.8
MAX_ITERATIONS = 30


class Fixed(NamedTuple):
    """What stays as it is while one step is iterated.

    Attributes:
        drive: Drive lengths at its start (m,) [m].
        load: Integration rule.
        target: Outputs wanted (1, 7 + m).
        previous: Input of the step before (m,) [m/s].
        low: Lower limits of the input (m,) [m/s].
        high: Upper limits (m,) [m/s].
    """

    drive: Array
    load: Load
    target: Array
    previous: Array
    low: Array
    high: Array


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
        self._normal = robot.rest_normal if settings.output == "pose" else None
        self._speed = np.zeros(robot.n_cables)
        self._last: tuple[Array, Array, Fixed] | None = None
        self.ahead = np.array([settings.period_s])

    def _load(self, estimate: Estimate, v: Array) -> tuple[Array, Load]:
        """Start positions and load of the step (12)-(14) with zero acceleration at its start; or of statics."""
        h, s, robot = self._settings.period_s, self._scratch, self._robot
        if self._settings.model == "static":
            return estimate.q.copy(), static_load(robot.model, robot.weight)
        c = coefficients(RHO, h)
        inertia = c.acceleration + robot.model.damping * c.velocity
        q0 = estimate.q + h * v
        s.nodal[Q_FREE] = q0 - robot.model.damping * v / inertia
        s.nodal[FORCE] = robot.weight
        dynamics.lengths_before(
            robot.model, estimate.q, v, estimate.drive, self._speed, 0.5 * h, s, self._work
        )
        nodal, bars, cables = (array.copy() for array in (s.nodal, s.bar_before, s.cable_before))
        return q0, Load(inertia, 2.0 / h, nodal, bars, cables, None)

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

    def _iterate(self, q: Array, speed: Array, fixed: Fixed) -> tuple[Array, Solution]:
        """(28) with (36): change of the free coordinates (12 n_modules,), and the new input with proof."""
        h = self._settings.period_s
        step, prediction = self._linearise(q, fixed.drive + h * speed, fixed.load, speed)
        problem = build_ioc(prediction, fixed.target, fixed.previous, fixed.low, fixed.high, self._weights)
        solution = Solution(*solve_ioc(problem, prediction, self._weights))
        return step + h * (self._gain @ (solution.inputs - speed)), solution

    def sharpen(self) -> None:
        """Nothing to do: (41) always ends with a whole Newton step."""

    def memory(self) -> Mapping[str, Kept]:
        """Last input and integral action."""
        return {"speed": Kept(self._speed, SPEED), **self._integral.memory(self._normal)}

    def inner_map(self) -> InnerMap | None:
        """(43) about the solution of the last step.

        z are the free coordinates and the input, which stands for the actuation nodes (20). The multipliers of
        (22) enter it linearly, so z^(j+1) does not depend on theirs: they only add eigenvalues 0.
        """
        if self._last is None:
            return None
        q, speed, fixed = self._last
        first, size = 3 * FIXED, q.size - 3 * FIXED

        def apply(z: Array) -> Array:
            moved = q.copy()
            moved[first:] = z[:size]
            change, solution = self._iterate(moved, z[size:], fixed)
            return np.concatenate([z[:size] + change, solution.inputs])

        scale = np.concatenate([np.full(size, POSITION), np.full(speed.size, SPEED)])
        return InnerMap(
            "(28) with (36): Newton and LCP together", np.concatenate([q[first:], speed]), scale, apply
        )

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Command for the coming period; the drives are held if (41) was not reached."""
        h, m = self._settings.period_s, self._robot.n_cables
        self._normal = estimate.normal if self._settings.output == "pose" else None
        shift = self._integral.update(pose_error(reference, estimate.position, estimate.normal), False)
        low, high = input_limits(self._settings, self._robot, estimate.drive, 1)
        q, load = self._load(estimate, estimate.v)
        target = make_target(self._settings, reference, shift, m)
        fixed = Fixed(estimate.drive.copy(), load, target, self._speed, low, high)
        speed, change, iteration = self._speed, np.inf, 0
        solution = Solution(speed, np.inf, 0, False, 0)
        while change > EPSILON and iteration < MAX_ITERATIONS and np.all(np.isfinite(q)):
            moved, solution = self._iterate(q, speed, fixed)
            q[3 * FIXED :] += moved
            speed, iteration = solution.inputs, iteration + 1
            change = float(np.linalg.norm(moved) / np.linalg.norm(q))
        good = change <= EPSILON and solution.solved and estimate.converged
        self._last = (q, speed, fixed) if good else None
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
