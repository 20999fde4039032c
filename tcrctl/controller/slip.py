"""How fast cables slip through the holes, as the drag of a dithered robot follows it.

The mean friction of a cable that is moved to and fro answers a change of the mean slip only within the next half
wave. So the drag f of robot.hole_drag follows with a time constant τ, a part of a wave,

    τ f' = c p ((1 - ξ) ũ + p' v) - f,        ũ' = (u - ũ) / lag

with ũ the speed of a cable behind its drive. A loop that does not count it feeds the slow modes of the robot where
it means to damp them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array


class Slip(NamedTuple):
    """What is slipping, changed in place; every speed as the drag follows it.

    Attributes:
        cables: Speeds of the cables behind their drives (m,) [m/s].
        speed: The same, followed (m,) [m/s].
        v: Node velocities, followed (3 n_nodes,) [m/s].
    """

    cables: Array
    speed: Array
    v: Array


def no_slip(n_cables: int, size: int) -> Slip:
    """Return that of a robot at rest with so many cables and node coordinates."""
    return Slip(np.zeros(n_cables), np.zeros(n_cables), np.zeros(size))


@part(error_model="numpy")
def _part(period: float, time: float) -> float:
    """Return the part of the way that a first-order lag goes in one step; all of it without a time constant."""
    return 1.0 - math.exp(-period / time) if time > 0.0 else 1.0


@part(error_model="numpy")
def follow_slip(slip: Slip, speed: Array, v: Array, period: float, lag: float, time: float) -> None:
    """Move on by one step.

    Args:
        slip: Changed.
        speed: Last input (m,) [m/s].
        v: Node velocities (3 n_nodes,) [m/s].
        period: Length of the step [s].
        lag: Of the drives [s].
        time: τ [s].
    """
    behind, turned = _part(period, lag), _part(period, time)
    for c in range(speed.shape[0]):
        slip.cables[c] += behind * (speed[c] - slip.cables[c])
        slip.speed[c] += turned * (slip.cables[c] - slip.speed[c])
    for k in range(v.shape[0]):
        slip.v[k] += turned * (v[k] - slip.v[k])
