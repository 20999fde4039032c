"""From settings to the arrays of the quadratic program: weights, targets and input limits."""

from __future__ import annotations

import numpy as np

from tcrctl.controller.cost_arrays import fill_target, limits, move_on
from tcrctl.controller.feedforward import reference_poses
from tcrctl.controller.ioc import Weights
from tcrctl.controller.settings import IocSettings, KinematicSettings, speed_limit
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Estimate, Reference


def make_weights(settings: IocSettings, m: int, instants: int) -> Weights:
    """Return the weights of (30) for ``m`` cables; position-only tracking has no weight on normal and twist.

    The output weights are shared out over the prediction ``instants``, so that the cost is their mean and R and W
    mean the same whatever their number. W is what keeps the loop stable when the plant's slow modes are faster
    or slower than the model's; a sum over the instants would weaken it as many times.
    """
    w, tension = settings.weights, settings.tension
    output = np.zeros(POSE_ROWS + m)
    output[:3] = w.position
    if settings.output == "pose":
        output[3:6], output[6] = w.normal, w.twist
    if tension is None:
        return Weights(output / instants, w.speed, w.speed_change, -np.inf, np.inf, 1.0)
    output[POSE_ROWS:] = tension.weight
    return Weights(
        output / instants,
        w.speed,
        w.speed_change,
        tension.floor_n,
        tension.ceiling_n,
        instants * tension.softness,
    )


def make_target(settings: IocSettings, reference: Reference, shift: Array, m: int) -> Array:
    """Return outputs wanted at the prediction instants (n, 7 + m), shifted by the integral action (6,)."""
    target: Array = fill_target(reference_poses(reference), shift, wanted_tension(settings), m)
    return target


def wanted_tension(settings: IocSettings) -> float:
    """Return the tension that cables should have [N]; 0 without any wish, which has no weight then."""
    return 0.0 if settings.tension is None else float(settings.tension.reference_n)


def input_limits(
    settings: IocSettings | KinematicSettings, robot: Robot, drive: Array, blocks: int, reserve: float = 0.0
) -> tuple[Array, Array]:
    """Return hard limits of all inputs (blocks * m,) [m/s]: speed; for the first block also the stroke.

    Args:
        settings: Speed limit and period.
        robot: Its stroke.
        drive: Drive lengths now (m,) [m].
        blocks: Number of input blocks.
        reserve: What of the speed limit is kept for something else [m/s].
    """
    limit, (low, high) = speed_limit(settings) - reserve, robot.stroke
    return limits(drive, limit, low, high, settings.period_s, blocks)


def pose_error(reference: Reference, position: Array, normal: Array) -> Array:
    """Return the wanted minus measured end pose (6,): position [m], normal (0 where it is not tracked)."""
    error = np.zeros(6)
    error[:3] = reference.position - position
    if reference.normal is not None:
        error[3:] = reference.normal - normal
    return error


def outputs(estimate: Estimate, age: float, robot: Robot) -> Array:
    """Return outputs now (7 + m,): end position, normal, twist, tensions, moved on by ``age`` [s] with v."""
    now = np.empty(POSE_ROWS + estimate.tension.shape[0])
    now[:3], now[3:6], now[POSE_ROWS:] = estimate.position, estimate.normal, estimate.tension
    move_on(estimate.q, estimate.v, age, robot.tip, now)
    return now
