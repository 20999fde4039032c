"""One step of instantaneous optimal control in one kernel: target, free changes, program, solution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.controller.blocks import Grid
from tcrctl.controller.cost_arrays import fill_target
from tcrctl.controller.feedforward import needed_speeds, wanted_changes
from tcrctl.controller.ioc import Prediction, Solution, Weights, build_ioc, solve_ioc
from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array


class Demand(NamedTuple):
    """What is wanted of the robot, and what limits it.

    Attributes:
        poses: Position [m] and normal wanted now and at the prediction instants (n + 1, 6).
        shift: What the integral action adds to them (6,).
        tension: Tension wanted [N].
        previous: Input of the last step (m,) [m/s].
        needed: Speeds that the reference needed then (m,) [m/s].
        low: Lower limits of the inputs (blocks * m,) [m/s].
        high: Upper limits (blocks * m,) [m/s].
    """

    poses: Array
    shift: Array
    tension: float
    previous: Array
    needed: Array
    low: Array
    high: Array


@part(error_model="numpy")
def _finite(values: Array) -> bool:
    """Return whether all values are finite: else their square is not."""
    flat = values.ravel()
    return bool(np.isfinite(np.dot(flat, flat)))


@kernel(error_model="numpy")
def optimum(
    prediction: Prediction, rest_gain: Array, demand: Demand, grid: Grid, weights: Weights
) -> tuple[Solution, Array]:
    """Find the optimal inputs.

    Args:
        prediction: Predicted outputs.
        rest_gain: Position and normal by the drives at rest (6, m); zeros need no speeds.
        demand: What is wanted.
        grid: Prediction instants and input blocks.
        weights: Weights of the cost.

    Returns:
        The solution, without any row if the prediction is not finite; and the speeds that the reference needs now
        (m,) [m/s].
    """
    if not (_finite(prediction.free) and _finite(prediction.gain)):
        nothing = np.zeros(demand.low.shape[0])
        return Solution(nothing, np.inf, 0, False, 0, prediction.free), np.zeros(demand.needed.shape[0])
    needed = needed_speeds(rest_gain, weights.output, demand.poses, grid.edges, grid.ahead[0])
    changes = wanted_changes(demand.previous, demand.needed, needed)
    target = fill_target(demand.poses, demand.shift, demand.tension, needed.shape[1])
    program = build_ioc(prediction, target, changes, demand.low, demand.high, weights)
    return solve_ioc(program, prediction, weights), needed[0].copy()
