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

from tcrctl.controller.cost import make_target, make_weights
from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.ioc import Prediction, Solution, build_ioc, solve_ioc
from tcrctl.controller.plan import Plan, Situation
from tcrctl.controller.settings import IocSettings
from tcrctl.memory import POSITION, SPEED, Kept
from tcrctl.numerics.generalized_alpha import coefficients
from tcrctl.robot import dynamics, linear, pose
from tcrctl.robot.equations import FORCE, Q_FREE, Load, assemble, make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.module import FIXED
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

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
    """Algorithm 1. It has neither a prediction from an older estimate nor an anti-windup.

    Attributes:
        ahead: The one prediction instant (1,) [s].
        blocks: One block of inputs.
        gain: ∂q/∂d where the iteration was linearised last (n_free, m).
    """

    extrapolates = anti_windup = False

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        """Take a ``controller:`` section and the robot."""
        self._settings, self._robot = settings, robot
        self._weights = make_weights(settings, robot.n_cables, 1)
        self._work = make_workspace(robot.model)
        self._scratch = dynamics.make_scratch(robot.model)
        self.gain = np.zeros((self._work.r.shape[0], robot.n_cables))
        self._last: tuple[Array, Array, Fixed] | None = None
        self.ahead, self.blocks = np.array([settings.period_s]), 1

    def _load(self, at: Situation) -> tuple[Array, Load]:
        """Start positions and load of the step (12)-(14) with zero acceleration at its start; or of statics."""
        period = self._settings.period_s
        s = self._scratch
        robot = self._robot
        x = at.estimate
        if self._settings.model == "static":
            return x.q.copy(), static_load(robot.model, robot.weight)
        c = coefficients(RHO, period)
        inertia = c.acceleration + robot.model.damping * c.velocity
        q0 = x.q + period * x.v
        s.nodal[Q_FREE] = q0 - robot.model.damping * x.v / inertia
        s.nodal[FORCE] = robot.weight
        dynamics.lengths_before(robot.model, x.q, x.v, x.drive, at.previous, 0.5 * period, s, self._work)
        nodal, bars, cables = (array.copy() for array in (s.nodal, s.bar_before, s.cable_before))
        return q0, Load(inertia, 2.0 / period, nodal, bars, cables, None)

    def _linearise(self, q: Array, drive: Array, load: Load, speed: Array) -> tuple[Array, Prediction]:
        """Return the Newton step (n_free,) at the present input, and the outputs as (31)."""
        period = self._settings.period_s
        tip = self._robot.tip
        ws = self._work
        assemble(self._robot.model, q, drive, load, ws, True)
        linear.factor_shifted(ws.K, ws.U)
        change = np.zeros(ws.r.shape[0])
        linear.solve(ws, -ws.r, change)
        linear.drive_gain(ws, self.gain)
        first, m = 3 * (tip - FIXED), speed.shape[0]
        C = pose.output_matrix(q, tip)
        gain = np.empty((1, POSE_ROWS + m, m))
        gain[0, :POSE_ROWS] = period * (C @ self.gain[first : first + 9])
        gain[0, POSE_ROWS:] = period * linear.tension_gain(ws, self.gain)
        now = np.concatenate([pose.position(q, tip), pose.normal(q, tip), [pose.twist(q, tip)], ws.tension])
        now[:POSE_ROWS] += C @ change[first : first + 9]
        now[POSE_ROWS:] += ws.axial * (ws.G[:, 3 * FIXED :] @ change)
        return change, Prediction((now - gain[0] @ speed)[None], gain)

    def _iterate(self, q: Array, speed: Array, fixed: Fixed) -> tuple[Array, Solution]:
        """Return (28) with (36): change of the free coordinates (n_free,), and the new input with proof."""
        period = self._settings.period_s
        change, prediction = self._linearise(q, fixed.drive + period * speed, fixed.load, speed)
        program = build_ioc(prediction, fixed.target, fixed.previous, fixed.low, fixed.high, self._weights)
        solution = solve_ioc(program, prediction, self._weights)
        return change + period * (self.gain @ (solution.inputs - speed)), solution

    def sharpen(self) -> None:
        """Do nothing: (41) always ends with a whole Newton step."""

    def memory(self) -> Mapping[str, Kept]:
        """Return nothing: all but the last input is in the estimate."""
        return {}

    def inner_map(self) -> InnerMap | None:
        """Return (43) about the solution of the last step.

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

    def plan(self, at: Situation) -> Plan:
        """Iterate (28) until (41) holds."""
        q, load = self._load(at)
        target = make_target(self._settings, at.reference, at.shift, self._robot.n_cables)
        fixed = Fixed(at.estimate.drive.copy(), load, target, at.previous, at.low, at.high)
        speed = at.previous
        change = np.inf
        iteration = 0
        solution = Solution(speed, np.inf, 0, False, 0, np.zeros((0, 0)))
        while change > EPSILON and iteration < MAX_ITERATIONS and np.all(np.isfinite(q)):
            moved, solution = self._iterate(q, speed, fixed)
            q[3 * FIXED :] += moved
            speed, iteration = solution.inputs, iteration + 1
            change = float(np.linalg.norm(moved) / np.linalg.norm(q))
        good = change <= EPSILON and solution.solved
        self._last = (q, speed, fixed) if good and not at.doubt else None
        return Plan(
            speed=speed,
            tension=self._work.tension.copy(),
            iterations=iteration,
            residual=float(np.max(np.abs(self._work.r))),
            lcp_residual=solution.residual,
            lcp_pivots=solution.pivots,
            reason=""
            if good
            else f"(41) was not reached: |dz|/|z| = {change:.2g} after {iteration} iterations",
        )
