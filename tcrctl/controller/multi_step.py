"""Multi-step prediction: linear response about the model's equilibrium, shifted to where the robot comes to rest.

    q_eq(d)        static equilibrium of the model at the present drives, followed step by step
    δ = q - q_eq   deviation of the estimated state from it: vibration, and what the model does not know
    Δ              the lasting part of δ, found by weighing forces: a robot at q with acceleration a vibrates
                   about q + K^-1 M (a + α v), so Δ is that minus q_eq, filtered over ``filter_s``
    y(t)           = y now + C (δ(t) - δ(0)) with δ(0) - Δ released at velocity v, plus the ramps of the drives

Δ shifts the equilibrium instead of adding a force: a constant force that holds a wrong axial tension would press
on the slender robot like a dead load and make the prediction buckle. Weighing forces instead of filtering δ keeps
the lightly damped lateral mode out of Δ. At the first step the robot rests, and all of δ is Δ (``from_start``).
While a dither keeps the cables sliding, their drag counts in Δ and in the response (robot.hole_drag), as far as it
is there (controller.drag_share). Drives that lag answer late (controller.drive_lag). See docs/control.md.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tcrctl.controller.blocks import Grid, make_grid, superpose
from tcrctl.controller.drag_share import learning, nothing_known
from tcrctl.controller.drive_lag import DriveLag, with_lag
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.lasting_offset import MultiStepMemory, update_offset
from tcrctl.controller.plan import Situation
from tcrctl.controller.prediction_settings import MultiStepSettings
from tcrctl.controller.predictor import Forecast, Now, Tuning, make_tuning, present
from tcrctl.controller.rest_gain import gain_learning, no_gain
from tcrctl.controller.slip import follow_slip, no_slip
from tcrctl.controller.tension_gap import TensionGap
from tcrctl.memory import POSITION, SPEED, Kept
from tcrctl.numerics.kernel import kernel
from tcrctl.robot import linear, pose, response, response_basis
from tcrctl.robot.equations import Load, Workspace, make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.hole_drag import drag_force, fill_hole_drag, no_drag, turn
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot, hole_friction
from tcrctl.robot.sections import FrictionSettings
from tcrctl.robot.statics import MAX_ITERATIONS, TOLERANCE, follow, rest_map
from tcrctl.signals import Array


@kernel(error_model="numpy")
def forecast(
    model: Model,
    load: Load,
    ws: Workspace,
    memory: MultiStepMemory,
    now: Now,
    grid: Grid,
    tip: int,
    tuning: Tuning,
) -> tuple[Outcome, bool, Array, Array, Array]:
    """Make one prediction as in the module's docstring, in one kernel.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace.
        memory: State of the predictor, moved on by one step.
        now: State now.
        grid: Prediction instants, equally spaced, and input blocks.
        tip: Row of the first node of the tip ring.
        tuning: Filter and tolerance.

    Returns:
        Outcome of the statics, whether the response is stable, free (n, 7 + m), gain (n, 7 + m, blocks * m), and
        position and normal by the drives at rest (6, m).
    """
    at, q, v, behind = memory.at, now.q, now.v, now.arrived - now.place - now.drive
    outcome = follow(model, load, ws, at, now.drive, tuning.tolerance)
    if not outcome.converged:
        linear.couple(ws, ws.r)  # which is done where the model has been followed
    deviation = np.empty(q.shape[0])
    away = np.empty(q.shape[0])
    finite = True
    for k in range(q.shape[0]):
        deviation[k] = q[k] + now.age * v[k] - at.equilibrium[k]
        finite = finite and np.isfinite(deviation[k]) and np.isfinite(v[k])
    fill_hole_drag(model, at.equilibrium, ws, memory.friction, tuning.turn, memory.drag)
    if finite:
        follow_slip(memory.slip, now.speed, v, tuning.period, tuning.drives.lag, tuning.follow)
    if outcome.converged and tuning.blend > 0.0 and finite:
        update_offset(model, ws, memory, deviation, v, now.drive + behind, tip, tuning)
    for hole in range(memory.drag.coefficient.shape[0]):  # what is not learnt is not counted
        memory.drag.coefficient[hole] *= memory.share.share[0]
    for k in range(q.shape[0]):
        memory.v[k] = v[k]
        away[k] = deviation[k] - memory.offset[k]
    held = np.zeros(ws.r.shape[0])
    drag_force(model, memory.drag, memory.slip.v, memory.slip.speed, held)
    release = response.Release(away, v, memory.learnt.gain)
    drag = response.Drag(memory.drag, held, tuning.follow)
    change, stable = response.respond(model, at.equilibrium, release, grid.ahead, tip, ws, memory.basis, drag)
    with_lag(change, grid.ahead[0], tuning.drives, behind, now.set_point - now.arrived)
    free, gain = superpose(change, now.outputs, grid.edges)
    at_rest = pose.drive_gain(at.equilibrium, at.gain + memory.learnt.gain, tip)[:6]
    return outcome, stable, free, gain, at_rest


class MultiStep:
    """See the module's docstring."""

    def __init__(self, settings: MultiStepSettings, period: float, robot: Robot, dead_time: float) -> None:
        """Take a ``prediction:`` section, the control period [s], the robot, the drives' dead time [s]."""
        self._robot, self._feedforward = robot, settings.feedforward
        self.grid = make_grid(settings.instants, settings.blocks, settings.horizon_s)
        tuning = make_tuning(period, settings.filter_s)
        gain = gain_learning(settings.rest_gain, tuning.blend, period)
        self._tuning = tuning._replace(
            learning=learning(period), follow=settings.follow_s, gain=gain, drives=DriveLag(0.0, dead_time)
        )
        self._turn = settings.turn_s
        self._dead_time = dead_time
        self._work = make_workspace(robot.model)
        self._load = static_load(robot.model, robot.weight)
        at, still = rest_map(robot), np.zeros_like(robot.rest.q)
        q, drive = robot.rest.q.copy(), np.zeros(robot.n_cables)
        minimise(robot.model, q, drive, self._load, self._work, TOLERANCE, MAX_ITERATIONS, True)
        basis = response_basis.start_basis(robot.model, self._work, settings.modes)
        self._memory = MultiStepMemory(
            at,
            still,
            still.copy(),
            basis,
            no_drag(robot.model),
            _friction(robot),
            nothing_known(),
            no_slip(robot.n_cables, still.size),
            no_gain(still.size - 3 * FIXED, robot.n_cables),
        )
        self._solved = False
        self._fresh = int(settings.offset is not None and settings.offset.from_start)
        self._gap = TensionGap(settings.tension_gap, period, robot.n_cables)

    def sharpen(self) -> None:
        """See :class:`tcrctl.controller.inner_map.Linearisable`."""
        self._tuning = self._tuning.sharp()

    def memory(self) -> Mapping[str, Kept]:
        """Return offset and last velocities without the fixed base, if the offset moves, and the tension gap.

        The basis is left out: it turns within the modes it spans, which changes no response, and with nothing
        left to correct an error of it has no effect of first order. What is learnt of the gain is left out, too:
        a predictor that is sharpened learns nothing.
        """
        if self._tuning.blend == 0.0:
            return self._gap.memory()
        first = 3 * FIXED
        return {
            "offset": Kept(self._memory.offset[first:], POSITION),
            "last_v": Kept(self._memory.v[first:], SPEED),
            **self._gap.memory(),
        }

    def inner_map(self) -> InnerMap | None:
        """Return Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics; one LCP after it, not fed back", self._memory.at
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def _tuned(self, turn: float, lag: float) -> Tuning:
        """Return the tuning for a turn of friction [s/m] and a lag of the drives [s], which seldom change."""
        if (turn, lag) != (self._tuning.turn, self._tuning.drives.lag):
            self._tuning = self._tuning._replace(turn=turn, drives=DriveLag(lag, self._dead_time))
        return self._tuning

    def predict(self, at: Situation) -> Forecast:
        """See :class:`Predictor`."""
        robot, memory, estimate = self._robot, self._memory, at.estimate
        now, tuning = present(at), self._tuned(turn(self._turn, at.dither.amplitude), estimate.lag)
        if self._fresh > 0:  # the robot rests: all of its deviation is offset, on the mean
            memory.v[:], tuning = estimate.v, tuning._replace(blend=1.0 / self._fresh, turn=0.0, rests=True)
        outcome, stable, free, gain, at_rest = forecast(
            robot.model, self._load, self._work, memory, now, self.grid, robot.tip, tuning
        )
        if outcome.converged:
            free[:, POSE_ROWS:] -= self._gap.left_out(estimate.tension - self._work.tension)
            self._fresh = self._fresh + 1 if self._fresh and at.settling else 0
        good, self._solved = outcome.converged and stable, outcome.converged
        reason = "" if good else "the model has no stable equilibrium at the present drives"
        rest_gain = at_rest if self._feedforward else None
        return Forecast(Prediction(free, gain), good, outcome.iterations, outcome.residual, reason, rest_gain)


def _friction(robot: Robot) -> Array:
    """Return the friction of every hole (n_holes, 3): as the robot file says it, or as usual."""
    if robot.holes is not None:
        return robot.holes
    return hole_friction(FrictionSettings(), robot.model.first_hole)
