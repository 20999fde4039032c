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

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.controller.blocks import block_edges, superpose
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.predictor import Forecast
from tcrctl.controller.settings import IocSettings
from tcrctl.memory import POSITION, SPEED, Kept
from tcrctl.robot import linear, pose, response
from tcrctl.robot.equations import Load, Workspace, make_workspace
from tcrctl.robot.equilibrium import TOLERANCE as SHARP
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import FIXED, Model
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Estimate

#: Largest nodal force left in the model's equilibrium [N]: 1e-5 N moves the softest mode by 3 micrometres.
TOLERANCE = 1e-5
MAX_ITERATIONS = 40


class Memory(NamedTuple):
    """What the predictor keeps from step to step, changed in place.

    Attributes:
        equilibrium: q_eq (3 n_nodes,) [m].
        drive: Drives it belongs to (m,) [m].
        gain: ∂q_eq/∂d (12 n_modules, m).
        offset: Δ (3 n_nodes,) [m].
        v: Velocities of the last estimate (3 n_nodes,) [m/s].
        basis: Basis of the response (12 n_modules, modes + m).
    """

    equilibrium: Array
    drive: Array
    gain: Array
    offset: Array
    v: Array
    basis: Array


@njit(cache=True, error_model="numpy")
def follow(
    model: Model,
    load: Load,
    ws: Workspace,
    equilibrium: Array,
    drive: Array,
    gain: Array,
    wanted: Array,
    tolerance: float,
) -> Outcome:
    """Move the model's equilibrium to other drives, starting where its static gain points to.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace; afterwards it belongs to the new equilibrium.
        equilibrium: q_eq (3 n_nodes,) [m], moved.
        drive: Drives it belongs to (m,) [m], moved.
        gain: ∂q_eq/∂d (12 n_modules, m) with the taut cables, moved.
        wanted: The new drives (m,) [m].
        tolerance: Largest nodal force accepted [N].
    """
    q = equilibrium.copy()
    for k in range(gain.shape[0]):
        for c in range(drive.shape[0]):
            q[3 * FIXED + k] += gain[k, c] * (wanted[c] - drive[c])
    outcome = minimise(model, q, wanted, load, ws, tolerance, int(MAX_ITERATIONS), bool(1))
    if outcome.converged:
        equilibrium[:], drive[:] = q, wanted
        linear.couple(ws, ws.r)
        linear.drive_gain(ws, gain)
    return outcome


@njit(cache=True, error_model="numpy")
def _update_offset(
    model: Model, ws: Workspace, memory: Memory, deviation: Array, v: Array, period: float, blend: float
) -> None:
    """Filter the displacement of the point that the robot vibrates about: δ + K^-1 M (a + α v)."""
    force, lag = np.zeros(ws.r.shape[0]), np.zeros(ws.r.shape[0])
    for k in range(force.shape[0]):
        i, row = k // 12, k % 12
        for b in range(12):
            j = 12 * (i + 1) + b
            force[k] += model.mass[i, row, b] * ((v[j] - memory.v[j]) / period + model.damping * v[j])
    linear.solve(ws, force, lag)
    for k in range(force.shape[0]):
        j = 3 * FIXED + k
        memory.offset[j] += blend * (deviation[j] + lag[k] - memory.offset[j])


@njit(cache=True, error_model="numpy")
def forecast(
    model: Model,
    load: Load,
    ws: Workspace,
    memory: Memory,
    q: Array,
    v: Array,
    drive: Array,
    period: float,
    blend: float,
    ahead: Array,
    edges: Array,
    tip: int,
    now: Array,
    tolerance: float,
) -> tuple[Outcome, bool, Array, Array]:
    """One prediction as in the module's docstring, in one kernel.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace.
        memory: State of the predictor, moved on by one step.
        q: Node positions now (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths (m,) [m].
        period: Control period [s].
        blend: Part of the way that Δ goes in one step; 0 keeps it.
        ahead: Prediction instants (n,) [s], equally spaced.
        edges: Instants at which input blocks begin, and the end (blocks + 1,).
        tip: Row of the first node of the tip ring.
        now: Outputs now (7 + m,).
        tolerance: Largest nodal force left in the equilibrium [N].

    Returns:
        Outcome of the statics, whether the response is stable, free (n, 7 + m), gain (n, 7 + m, blocks * m).
    """  # fmt: skip
    outcome = follow(model, load, ws, memory.equilibrium, memory.drive, memory.gain, drive, tolerance)
    deviation, away, finite = np.empty(q.shape[0]), np.empty(q.shape[0]), True
    for k in range(q.shape[0]):
        deviation[k] = q[k] - memory.equilibrium[k]
        finite = finite and np.isfinite(deviation[k]) and np.isfinite(v[k])
    if outcome.converged and blend > 0.0 and finite:
        _update_offset(model, ws, memory, deviation, v, period, blend)
    for k in range(q.shape[0]):
        memory.v[k] = v[k]
        away[k] = deviation[k] - memory.offset[k]
    change, stable = response.respond(
        model,
        memory.equilibrium,
        away,
        v,
        ahead[0],
        ahead.shape[0],
        tip,
        ws,
        memory.basis,
    )
    free, gain = superpose(change, now, edges)
    return outcome, stable, free, gain


class MultiStep:
    """See the module's docstring."""

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._robot, self._period = robot, settings.period_s
        self.ahead: Array = np.arange(1.0, settings.instants + 1.0) * (settings.horizon_s / settings.instants)
        self.blocks = settings.blocks
        self.edges = block_edges(settings.instants, settings.blocks)
        offset = settings.offset
        self._blend = 0.0 if offset is None else -float(np.expm1(-settings.period_s / offset.filter_s))
        self._work, self._load = make_workspace(robot.model), static_load(robot.model, robot.weight)
        rest, still = robot.rest.q, np.zeros_like(robot.rest.q)
        minimise(
            robot.model,
            rest.copy(),
            np.zeros(robot.n_cables),
            self._load,
            self._work,
            TOLERANCE,
            MAX_ITERATIONS,
            True,
        )
        self._solved, self._tolerance = False, TOLERANCE
        basis = response.start_basis(robot.model, self._work, settings.modes)
        self._memory = Memory(
            rest.copy(), np.zeros(robot.n_cables), robot.rest.gain.copy(), still, still.copy(), basis
        )

    def sharpen(self) -> None:
        """See :class:`Predictor`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Offset and last velocities without the fixed base, if the offset moves.

        The basis is left out: it turns within the modes it spans, which changes no response, and with nothing
        left to correct an error of it has no effect of first order.
        """
        if self._blend == 0.0:
            return {}
        first = 3 * FIXED
        return {
            "offset": Kept(self._memory.offset[first:], POSITION),
            "last_v": Kept(self._memory.v[first:], SPEED),
        }

    def inner_map(self) -> InnerMap | None:
        """Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics; one LCP after it, not fed back", self._memory
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def predict(self, estimate: Estimate, age: float, now: Array, speed: Array) -> Forecast:
        """See :class:`Predictor`."""
        del speed  # the prediction is linear: it does not depend on the last input
        outcome, stable, free, gain = forecast(
            self._robot.model, self._load, self._work, self._memory, estimate.q + age * estimate.v, estimate.v,
            estimate.drive, self._period, self._blend, self.ahead, self.edges, self._robot.tip,
            now, self._tolerance,
        )  # fmt: skip
        outcome = Outcome(*outcome)
        good = outcome.converged and stable
        reason = "" if good else "the model has no stable equilibrium at the present drives"
        self._solved = outcome.converged
        at_rest = pose.drive_gain(self._memory.equilibrium, self._memory.gain, self._robot.tip)[:6]
        return Forecast(Prediction(free, gain), good, outcome.iterations, outcome.residual, reason, at_rest)
