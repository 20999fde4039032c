"""Multi-step prediction: linear response about the model's equilibrium, shifted to where the robot comes to rest.

    q_eq(d)        static equilibrium of the model at the present drives, followed step by step
    δ = q - q_eq   deviation of the estimated state from it: vibration, and what the model does not know
    Δ              the lasting part of δ, found by weighing forces: a robot at q with acceleration a vibrates
                   about q + K^-1 M (a + α v), so Δ is that minus q_eq, filtered over ``filter_s``
    y(t)           = y now + C (δ(t) - δ(0)) with δ(0) - Δ released at velocity v, plus the ramps of the drives

Δ shifts the equilibrium instead of adding a force: a constant force that holds a wrong axial tension would press
on the slender robot like a dead load and make the prediction buckle. Weighing forces instead of filtering δ keeps
the lightly damped lateral mode out of Δ. See docs/control.md.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tcrctl.controller.ioc import Prediction
from tcrctl.controller.predictor import Forecast
from tcrctl.controller.settings import IocSettings
from tcrctl.robot import linear, pose, response
from tcrctl.robot.equations import Workspace, make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import FIXED
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Estimate

#: Largest nodal force left in the model's equilibrium [N]: 1e-5 N moves the softest mode by 3 micrometres.
TOLERANCE = 1e-5
MAX_ITERATIONS = 40


def block_edges(instants: int, blocks: int) -> Array:
    """First instant of every block and the end (blocks + 1,): lengths grow about twofold, at least 1."""
    edges = [0]
    for b in range(1, blocks):
        wanted = round(instants * (2**b - 1) / (2**blocks - 1))
        edges.append(min(max(edges[-1] + 1, wanted), instants - (blocks - b)))
    return np.array([*edges, instants], dtype=np.int64)


@njit(cache=True, error_model="numpy")
def superpose(change: Array, now: Array, edges: Array) -> tuple[Array, Array]:
    """Outputs for piecewise constant speeds from the responses to ramps that begin now.

    Args:
        change: Responses (n, rows, m + 1) of robot.response.
        now: Outputs at the state (rows,).
        edges: Instants at which the blocks begin, and the end (blocks + 1,).

    Returns:
        free (n, rows) and gain (n, rows, blocks * m).
    """
    n, rows, m = change.shape[0], change.shape[1], change.shape[2] - 1
    free, gain = np.empty((n, rows)), np.zeros((n, rows, (edges.shape[0] - 1) * m))
    for i in range(n):
        for r in range(rows):
            free[i, r] = now[r] + change[i, r, m]
        for b in range(edges.shape[0] - 1):
            begun, ended = i - edges[b], i - edges[b + 1]
            if begun >= 0:
                for r in range(rows):
                    for c in range(m):
                        gain[i, r, b * m + c] = change[begun, r, c]
                        if ended >= 0:
                            gain[i, r, b * m + c] -= change[ended, r, c]
    return free, gain


@njit(cache=True, error_model="numpy")
def _inertia_lag(mass: Array, damping: float, acceleration: Array, v: Array, ws: Workspace) -> Array:
    """K^-1 M (a + α v) (12 n_modules,) [m] with the static factor in ``ws``."""
    force, lag = np.zeros(ws.r.shape[0]), np.zeros(ws.r.shape[0])
    for k in range(force.shape[0]):
        i, a = k // 12, k % 12
        for b in range(12):
            j = 12 * (i + 1) + b
            force[k] += mass[i, a, b] * (acceleration[j] + damping * v[j])
    linear.solve(ws, force, lag)
    return lag


class MultiStep:
    """See the module's docstring. State: equilibrium, offset Δ and last velocity."""

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._robot = robot
        self._step = settings.horizon_s / settings.instants
        self.ahead: Array = np.arange(1.0, settings.instants + 1.0) * self._step
        self.blocks = settings.blocks
        self._edges = block_edges(settings.instants, settings.blocks)
        self._period = settings.period_s
        offset = settings.offset
        self._blend = 0.0 if offset is None else -float(np.expm1(-settings.period_s / offset.filter_s))
        self._work, self._load = make_workspace(robot.model), static_load(robot.model, robot.weight)
        self._equilibrium = robot.rest.q.copy()
        self._offset, self._v = np.zeros_like(robot.rest.q), np.zeros_like(robot.rest.q)
        self._drive, self._gain = np.zeros(robot.n_cables), robot.rest.gain.copy()
        self._follow(self._drive)
        self._basis = response.start_basis(robot.model, self._work, settings.modes)

    def _follow(self, drive: Array) -> Outcome:
        """Move the model's equilibrium to ``drive``, starting where its static gain points to."""
        q = self._equilibrium.copy()
        q[3 * FIXED :] += self._gain @ (drive - self._drive)
        outcome = Outcome(
            *minimise(self._robot.model, q, drive, self._load, self._work, TOLERANCE, MAX_ITERATIONS, True)
        )
        if outcome.converged:
            self._equilibrium, self._drive = q, drive.copy()
            linear.couple(self._work, self._work.r)
            linear.drive_gain(self._work, self._gain)
        return outcome

    def _update_offset(self, deviation: Array, v: Array) -> None:
        """Filter the displacement of the point that the robot vibrates about."""
        model = self._robot.model
        acceleration = (v - self._v) / self._period
        centre = deviation.copy()
        centre[3 * FIXED :] += _inertia_lag(model.mass, model.damping, acceleration, v, self._work)
        self._offset = self._offset + self._blend * (centre - self._offset)

    def predict(self, estimate: Estimate, age: float, speed: Array) -> Forecast:
        """See :class:`Predictor`."""
        del speed  # the prediction is linear: it does not depend on the last input
        outcome = self._follow(estimate.drive)
        deviation = estimate.q + age * estimate.v - self._equilibrium
        if outcome.converged and self._blend:
            self._update_offset(deviation, estimate.v)
        self._v = estimate.v
        change, stable = response.respond(
            self._robot.model, self._equilibrium, deviation - self._offset, estimate.v, self._step,
            self.ahead.shape[0], self._robot.tip, self._work, self._basis,
        )  # fmt: skip
        free, gain = superpose(change, outputs(estimate, age, self._robot), self._edges)
        good = outcome.converged and stable
        reason = "" if good else "the model has no stable equilibrium at the present drives"
        return Forecast(Prediction(free, gain), good, outcome.iterations, outcome.residual, reason)


def outputs(estimate: Estimate, age: float, robot: Robot) -> Array:
    """Outputs now (7 + m,): end position, normal, twist, tensions, moved on by ``age`` [s] with the velocity."""
    first = 3 * robot.tip
    moved = age * (pose.output_matrix(estimate.q, robot.tip) @ estimate.v[first : first + 9])
    twist = pose.twist(estimate.q, robot.tip)
    now = np.concatenate([estimate.position, estimate.normal, [twist], estimate.tension])
    now[: response.POSE_ROWS] += moved
    return now
