"""From settings to the arrays of the quadratic program: weights, targets and input limits."""

from __future__ import annotations

import numpy as np

from tcrctl.controller.ioc import Weights
from tcrctl.controller.settings import IocSettings, KinematicSettings, speed_limit
from tcrctl.robot import pose
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
    n = reference.ahead_position.shape[0]
    target = np.zeros((n, POSE_ROWS + m))
    target[:, :3] = reference.ahead_position + shift[:3]
    if reference.ahead_normal is not None:
        target[:, 3:6] = reference.ahead_normal + shift[3:]
    if settings.tension is not None:
        target[:, POSE_ROWS:] = settings.tension.reference_n
    return target


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
    limit = speed_limit(settings) - reserve
    low = np.full(blocks * drive.shape[0], -limit)
    high = np.full(blocks * drive.shape[0], limit)
    m = drive.shape[0]
    # a drive outside its stroke may still move back: limits never cross
    low[:m] = np.minimum(np.maximum((robot.stroke[0] - drive) / settings.period_s, -limit), limit)
    high[:m] = np.maximum(np.minimum((robot.stroke[1] - drive) / settings.period_s, limit), -limit)
    return low, high


def pose_error(reference: Reference, position: Array, normal: Array) -> Array:
    """Return the wanted minus measured end pose (6,): position [m], normal (0 where it is not tracked)."""
    turned = np.zeros(3) if reference.normal is None else reference.normal - normal
    return np.concatenate([reference.position - position, turned])


def outputs(estimate: Estimate, age: float, robot: Robot) -> Array:
    """Return outputs now (7 + m,): end position, normal, twist, tensions, moved on by ``age`` [s] with v."""
    first = 3 * robot.tip
    moved = age * (pose.output_matrix(estimate.q, robot.tip) @ estimate.v[first : first + 9])
    twist = pose.twist(estimate.q, robot.tip)
    now = np.concatenate([estimate.position, estimate.normal, [twist], estimate.tension])
    now[:POSE_ROWS] += moved
    return now
