"""Static prediction: the first equation of (9) without inertia and damping, so the end follows the drives at once.

    q_eq(d)        static equilibrium of the model at the present drives, followed step by step
    Δ              filtered difference between the outputs as they are and as q_eq(d) has them
    y(t)           h(q_eq(d)) + Δ + S times what the drives move until t,  S = ∂h/∂q ∂q_eq/∂d

Nothing in it swings: what the slow modes do passes for an offset, delayed by the filter. ``offset: off`` leaves the
bare statics, which do not look at the measured end at all; a very short filter takes the measured end for the place
where the robot rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.controller.blocks import block_edges, superpose
from tcrctl.controller.inner_map import InnerMap, newton_map
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.multi_step import TOLERANCE, follow
from tcrctl.controller.predictor import Forecast
from tcrctl.controller.settings import IocSettings
from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.memory import NORMAL, POSITION, TENSION, Kept
from tcrctl.robot import linear, pose
from tcrctl.robot.equations import Load, Workspace, make_workspace
from tcrctl.robot.equilibrium import TOLERANCE as SHARP
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import FIXED, Model
from tcrctl.robot.potential import Outcome
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Estimate


class StaticMap(NamedTuple):
    """The model at rest at certain drives, changed in place; see :func:`follow`.

    Attributes:
        equilibrium: q_eq (3 n_nodes,) [m].
        drive: Drives it belongs to (m,) [m].
        gain: ∂q_eq/∂d (12 n_modules, m).
    """

    equilibrium: Array
    drive: Array
    gain: Array


def rest_map(robot: Robot) -> StaticMap:
    """Static map of a robot at zero drive."""
    return StaticMap(robot.rest.q.copy(), np.zeros(robot.n_cables), robot.rest.gain.copy())


@njit(cache=True, error_model="numpy")
def static_outputs(model: Model, ws: Workspace, at: StaticMap, tip: int) -> tuple[Array, Array]:
    """Outputs at rest (7 + m,) and their derivatives by the drives (7 + m, m).

    Cables count as two-sided, so that a slack one still has authority over its (negative) tension.

    Args:
        model: Robot arrays.
        ws: Workspace as :func:`follow` left it; its axial stiffness is changed.
        at: Where the model is.
        tip: Row of the first node of the tip ring.
    """
    m, first = model.cables.shape[0], 3 * (tip - FIXED)
    rest, gain = np.empty(POSE_ROWS + m), np.empty((POSE_ROWS + m, m))
    rest[:3] = pose.position(at.equilibrium, tip)
    rest[3:6] = pose.normal(at.equilibrium, tip)
    rest[6] = pose.twist(at.equilibrium, tip)
    rest[POSE_ROWS:] = ws.tension
    for c in range(m):
        ws.axial[c] = model.cables[c, STIFFNESS]
    linear.couple(ws, ws.r)
    answer = np.empty((ws.r.shape[0], m))
    linear.drive_gain(ws, answer)
    gain[:POSE_ROWS] = np.dot(pose.output_matrix(at.equilibrium, tip), answer[first : first + 9])
    gain[POSE_ROWS:] = linear.tension_gain(ws, answer)
    return rest, gain


@njit(cache=True, error_model="numpy")
def forecast(
    model: Model,
    load: Load,
    ws: Workspace,
    at: StaticMap,
    offset: Array,
    drive: Array,
    blend: float,
    ahead: Array,
    edges: Array,
    tip: int,
    now: Array,
    tolerance: float,
) -> tuple[Outcome, Array, Array]:
    """One prediction as in the module's docstring, in one kernel.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace.
        at: Static map, moved to ``drive``.
        offset: Δ (7 + m,), moved on by one step.
        drive: Drive lengths now (m,) [m].
        blend: Part of the way that Δ goes in one step; 0 keeps it.
        ahead: Prediction instants (n,) [s].
        edges: Instants at which input blocks begin, and the end (blocks + 1,).
        tip: Row of the first node of the tip ring.
        now: Outputs now (7 + m,).
        tolerance: Largest nodal force left in the equilibrium [N].

    Returns:
        Outcome of the statics, free (n, 7 + m), gain (n, 7 + m, blocks * m).
    """
    outcome = follow(model, load, ws, at.equilibrium, at.drive, at.gain, drive, tolerance)
    rest, answer = static_outputs(model, ws, at, tip)
    if outcome.converged and blend > 0.0 and np.isfinite(now).all():
        offset += blend * (now - rest - offset)
    change = np.zeros((ahead.shape[0], rest.shape[0], drive.shape[0] + 1))
    for i in range(ahead.shape[0]):
        change[i, :, :-1] = ahead[i] * answer
    free, gain = superpose(change, rest + offset, edges)
    return outcome, free, gain


class Static:
    """See the module's docstring."""

    def __init__(self, settings: IocSettings, robot: Robot) -> None:
        self._robot = robot
        self.ahead: Array = np.arange(1.0, settings.instants + 1.0) * (settings.horizon_s / settings.instants)
        self.blocks = settings.blocks
        self.edges = block_edges(settings.instants, settings.blocks)
        offset = settings.offset
        self._blend = 0.0 if offset is None else -float(np.expm1(-settings.period_s / offset.filter_s))
        self._work, self._load = make_workspace(robot.model), static_load(robot.model, robot.weight)
        self._solved, self._tolerance = False, TOLERANCE
        self._at, self._offset = rest_map(robot), np.zeros(POSE_ROWS + robot.n_cables)

    def sharpen(self) -> None:
        """See :class:`Predictor`."""
        self._tolerance = SHARP

    def memory(self) -> Mapping[str, Kept]:
        """Offset of position, normal, twist and tensions, if it moves."""
        if self._blend == 0.0:
            return {}
        parts = (("position", 0, 3, POSITION), ("normal", 3, 6, NORMAL), ("twist", 6, POSE_ROWS, NORMAL))
        kept = {f"offset_{name}": Kept(self._offset[a:b], scale) for name, a, b, scale in parts}
        return {**kept, "offset_tension": Kept(self._offset[POSE_ROWS:], TENSION)}

    def inner_map(self) -> InnerMap | None:
        """Newton's iteration of the statics at the present drives."""
        what, at = "Newton on the statics; one LCP after it, not fed back", self._at
        return newton_map(what, self._robot, self._load, at.drive, at.equilibrium) if self._solved else None

    def predict(self, estimate: Estimate, age: float, now: Array, speed: Array) -> Forecast:
        """See :class:`Predictor`."""
        del age, speed  # at rest the past does not matter
        outcome, free, gain = forecast(
            self._robot.model, self._load, self._work, self._at, self._offset, estimate.drive, self._blend,
            self.ahead, self.edges, self._robot.tip, now, self._tolerance,
        )  # fmt: skip
        outcome = Outcome(*outcome)
        reason = "" if outcome.converged else "the model has no stable equilibrium at the present drives"
        prediction, self._solved = Prediction(free, gain), outcome.converged
        at_rest = pose.drive_gain(self._at.equilibrium, self._at.gain, self._robot.tip)[:6]
        return Forecast(prediction, outcome.converged, outcome.iterations, outcome.residual, reason, at_rest)
