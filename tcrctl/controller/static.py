"""Static prediction: the first equation of (9) without inertia and damping, so the end follows the drives at once.

    q_eq(d)        static equilibrium of the model at the present drives, followed step by step
    Δ              filtered difference between the outputs as they are and as q_eq(d) has them
    y(t)           y(q_eq(d)) + Δ + S times what the drives move until t,  S = ∂y/∂q ∂q_eq/∂d

Nothing in it swings: what the slow modes do passes for an offset, delayed by the filter. ``offset: off`` leaves the
bare statics, which do not look at the measured end at all; a very short filter takes the measured end for the place
where the robot rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tcrctl.controller.blocks import Grid, make_grid, superpose
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.plan import Situation
from tcrctl.controller.prediction_settings import MultiStepSettings
from tcrctl.controller.predictor import Forecast, Now, Tuning, make_tuning, present
from tcrctl.memory import NORMAL, POSITION, TENSION, Kept
from tcrctl.numerics.kernel import kernel
from tcrctl.robot import pose
from tcrctl.robot.equations import Load, Workspace, make_workspace
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import Model
from tcrctl.robot.potential import Outcome
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.robot.statics import StaticMap, follow, rest_map, static_outputs
from tcrctl.signals import Array


class StaticMemory(NamedTuple):
    """What the predictor keeps from step to step, changed in place.

    Attributes:
        at: Where the model is at rest.
        offset: Δ (7 + m,).
    """

    at: StaticMap
    offset: Array


@kernel(error_model="numpy")
def forecast(
    model: Model,
    load: Load,
    ws: Workspace,
    memory: StaticMemory,
    now: Now,
    grid: Grid,
    tip: int,
    tuning: Tuning,
) -> tuple[Outcome, Array, Array]:
    """Make one prediction as in the module's docstring, in one kernel.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace.
        memory: State of the predictor, moved on by one step.
        now: State now, of which only drives and outputs matter.
        grid: Prediction instants and input blocks.
        tip: Row of the first node of the tip ring.
        tuning: Filter and tolerance.

    Returns:
        Outcome of the statics, free (n, 7 + m), gain (n, 7 + m, blocks * m).
    """
    at = memory.at
    offset = memory.offset
    blend = tuning.blend
    outcome = follow(model, load, ws, at, now.drive, tuning.tolerance)
    rest, answer = static_outputs(model, ws, at, tip)
    if outcome.converged and blend > 0.0 and np.isfinite(now.outputs).all():
        offset += blend * (now.outputs - rest - offset)
    change = np.zeros((grid.ahead.shape[0], rest.shape[0], now.drive.shape[0] + 1))
    for i in range(grid.ahead.shape[0]):
        change[i, :, :-1] = grid.ahead[i] * answer
    free, gain = superpose(change, rest + offset, grid.edges)
    return outcome, free, gain


class Static:
    """See the module's docstring."""

    def __init__(self, settings: MultiStepSettings, period: float, robot: Robot, dead_time: float) -> None:
        """Take a ``prediction:`` section, the control period [s] and the robot."""
        del dead_time  # at rest they have arrived
        self._robot, self._feedforward = robot, settings.feedforward
        self.grid = make_grid(settings.instants, settings.blocks, settings.horizon_s)
        self._tuning = make_tuning(period, settings.filter_s)
        self._work = make_workspace(robot.model)
        self._load = static_load(robot.model, robot.weight)
        self._memory = StaticMemory(rest_map(robot), np.zeros(POSE_ROWS + robot.n_cables))
        self._solved = False

    def sharpen(self) -> None:
        """See :class:`tcrctl.controller.inner_map.Linearisable`."""
        self._tuning = self._tuning.sharp()

    def memory(self) -> Mapping[str, Kept]:
        """Return the offset of position, normal, twist and tensions, if it moves."""
        if self._tuning.blend == 0.0:
            return {}
        offset = self._memory.offset
        parts = (("position", 0, 3, POSITION), ("normal", 3, 6, NORMAL), ("twist", 6, POSE_ROWS, NORMAL))
        kept = {f"offset_{name}": Kept(offset[a:b], scale) for name, a, b, scale in parts}
        return {**kept, "offset_tension": Kept(offset[POSE_ROWS:], TENSION)}

    def inner_map(self) -> InnerMap | None:
        """Return Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics; one LCP after it, not fed back", self._memory.at
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def predict(self, at: Situation) -> Forecast:
        """See :class:`Predictor`. At rest the past does not matter, nor does the age of the estimate."""
        robot, memory = self._robot, self._memory
        now = present(at)
        outcome, free, gain = forecast(
            robot.model, self._load, self._work, memory, now, self.grid, robot.tip, self._tuning
        )
        good = self._solved = outcome.converged
        reason = "" if good else "the model has no stable equilibrium at the present drives"
        at_rest = None
        if self._feedforward:
            at_rest = pose.drive_gain(memory.at.equilibrium, memory.at.gain, robot.tip)[:6]
        return Forecast(Prediction(free, gain), good, outcome.iterations, outcome.residual, reason, at_rest)
