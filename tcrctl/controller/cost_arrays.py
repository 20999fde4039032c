"""Kernels of ``cost``: targets, input limits and outputs as arrays, without any settings."""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.kernel import kernel
from tcrctl.robot import pose
from tcrctl.robot.response import POSE_ROWS
from tcrctl.signals import Array


@kernel(error_model="numpy")
def fill_target(poses: Array, shift: Array, tension: float, m: int) -> Array:
    """Return the target of ``cost.make_target`` for poses now and at the instants (n + 1, 6), and a tension [N]."""
    target = np.zeros((poses.shape[0] - 1, POSE_ROWS + m))
    for i in range(target.shape[0]):
        for a in range(6):
            target[i, a] = poses[i + 1, a] + shift[a]
        for c in range(m):
            target[i, POSE_ROWS + c] = tension
    return target


@kernel(error_model="numpy")
def limits(
    drive: Array, limit: float, shortest: float, longest: float, period: float, blocks: int
) -> tuple[Array, Array]:
    """Return the limits of ``cost.input_limits`` for a speed [m/s], a stroke [m] and a period [s]."""
    m = drive.shape[0]
    low, high = np.full(blocks * m, -limit), np.full(blocks * m, limit)
    for c in range(m):  # a drive outside its stroke may still move back: limits never cross
        low[c] = np.minimum(np.maximum((shortest - drive[c]) / period, -limit), limit)
        high[c] = np.maximum(np.minimum((longest - drive[c]) / period, limit), -limit)
    return low, high


@kernel(error_model="numpy")
def move_on(q: Array, v: Array, age: float, tip: int, now: Array) -> None:
    """Fill in the twist, and move the end pose in ``now`` (7 + m,) on by ``age`` [s]."""
    now[6] = pose.twist(q, tip)
    rate = np.dot(pose.output_matrix(q, tip), v[3 * tip : 3 * tip + 9])
    for i in range(POSE_ROWS):
        now[i] += age * rate[i]
