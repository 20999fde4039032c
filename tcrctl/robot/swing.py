"""In which directions cables move to and fro so that the robot is moved least."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

from tcrctl.robot import pose
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Cables up to which all combinations of signs are tried; beyond, signs alternate.
MOST_CABLES: Final = 14


def signs(robot: Robot) -> Array:
    """Return the directions (m,), +1 or -1, with which cables move so that the end is moved least.

    Of all combinations the one with the smallest sum of axial pull (which would shake the column) and of motion of
    the end, weighed by how far a cable reaches; the first cable counts +1.

    Args:
        robot: Its gain at rest says how far a cable moves the end.
    """
    m = robot.n_cables
    if m > MOST_CABLES or m == 1:
        return np.where(np.arange(m) % 2 == 0, 1.0, -1.0)
    gain = pose.drive_gain(robot.rest.q, robot.rest.gain, robot.tip)[:3]
    pull = np.vstack([gain / np.abs(gain).max(), np.ones(m) / m])
    best, least = np.ones(m), np.inf
    for rest in itertools.product((1.0, -1.0), repeat=m - 1):
        trial = np.array([1.0, *rest])
        size = float(np.sum((pull @ trial) ** 2))
        if size < least - 1e-12:
            best, least = trial, size
    return best
