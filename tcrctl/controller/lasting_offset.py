"""Where the robot comes to rest beside its model, found by weighing forces; see ``multi_step``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.controller.drag_share import DragShare, forget, learn
from tcrctl.controller.predictor import Tuning
from tcrctl.controller.rest_gain import RestGain, carry, rest, tell
from tcrctl.controller.slip import Slip
from tcrctl.numerics.kernel import part
from tcrctl.robot import linear
from tcrctl.robot.equations import Workspace
from tcrctl.robot.hole_drag import HoleDrag, drag_force
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED, SIZE
from tcrctl.robot.statics import StaticMap
from tcrctl.signals import Array


class MultiStepMemory(NamedTuple):
    """What the predictor keeps from step to step, changed in place.

    Attributes:
        at: Where the model is at rest.
        offset: Δ (3 n_nodes,) [m].
        v: Velocities of the last estimate (3 n_nodes,) [m/s].
        basis: Basis of the response (n_free, modes + m).
        drag: Drag of the dithered holes.
        friction: Their friction (n_holes, 3), columns as in ``elements.rubbing_cable``.
        share: How much of the drag that it gives there is.
        slip: What that drag follows.
        learnt: How the offset goes with the drives.
    """

    at: StaticMap
    offset: Array
    v: Array
    basis: Array
    drag: HoleDrag
    friction: Array
    share: DragShare
    slip: Slip
    learnt: RestGain


@part(error_model="numpy")
def _dragged(model: Model, ws: Workspace, memory: MultiStepMemory, turn: float) -> Array:
    """Return by what usual drag displaces the point that the robot vibrates about (n_free,) [m]."""
    moved = np.zeros(ws.r.shape[0])
    if turn > 0.0:
        drag_force(model, memory.drag, memory.slip.v, memory.slip.speed, moved)
        linear.solve_again(ws, moved)
    return moved


@part(error_model="numpy")
def _told(model: Model, ws: Workspace, memory: MultiStepMemory) -> Array:
    """Return the same for a robot that follows its drives at once (n_free,) [m]: no noise of cameras is in it."""
    speed, moved, v = memory.slip.speed, np.zeros(ws.r.shape[0]), np.zeros(memory.v.shape[0])
    for k in range(moved.shape[0]):
        for c in range(speed.shape[0]):
            v[3 * FIXED + k] += memory.at.gain[k, c] * speed[c]
    drag_force(model, memory.drag, v, speed, moved)
    linear.solve_again(ws, moved)
    return moved


@part(error_model="numpy")
def update_offset(
    model: Model,
    ws: Workspace,
    memory: MultiStepMemory,
    deviation: Array,
    v: Array,
    drive: Array,
    tip: int,
    tuning: Tuning,
) -> None:
    """Filter the displacement of the point that the robot vibrates about: δ + K^-1 (M (a + α v) - drag).

    Args:
        model: Robot arrays.
        ws: Workspace as ``statics.follow`` left it.
        memory: Its offset and what is learnt are changed.
        deviation: δ (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths without dither (m,) [m].
        tip: Row of the first node of the tip ring.
        tuning: Filter.
    """
    lag, period = np.zeros(ws.r.shape[0]), tuning.period
    for k in range(lag.shape[0]):
        i, row = k // SIZE, k % SIZE
        for b in range(SIZE):
            j = SIZE * (i + 1) + b
            lag[k] += model.mass[i, row, b] * ((v[j] - memory.v[j]) / period + model.damping * v[j])
    linear.solve_again(ws, lag)
    learns = tuning.gain.doubt > 0.0 and not tuning.rests
    if learns:
        carry(memory.learnt, tuning.gain, drive, memory.offset, tip)
    dragged = _dragged(model, ws, memory, tuning.turn)
    if tuning.turn > 0.0:
        told = _told(model, ws, memory)
        end = _end(deviation, lag, tip) - memory.learnt.moved
        learn(memory.share, tuning.learning, end, _end(np.zeros(v.shape[0]), told, tip))
    else:
        forget(memory.share, tuning.learning)
    for k in range(lag.shape[0]):
        lag[k] = deviation[3 * FIXED + k] + lag[k] - memory.share.share[0] * dragged[k]
    if learns:
        tell(memory.learnt, tuning.gain, lag, memory.offset, tip)
    else:
        rest(memory.learnt, tuning.gain, drive, tuning.blend)
        for k in range(lag.shape[0]):
            memory.offset[3 * FIXED + k] += tuning.blend * (lag[k] - memory.offset[3 * FIXED + k])


@part(error_model="numpy")
def _end(base: Array, free: Array, tip: int) -> Array:
    """Return the mean displacement (3,) of the tip ring in base (3 n_nodes,) plus free (n_free,)."""
    mean = np.zeros(3)
    for node in range(tip, tip + 3):
        for i in range(3):
            mean[i] += (base[3 * node + i] + free[3 * (node - FIXED) + i]) / 3.0
    return mean
