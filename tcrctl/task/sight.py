"""What a camera with a round picture sees: spheres in a cone, unless something is in between."""

from __future__ import annotations

import math

import numpy as np

from tcrctl.signals import Array


def in_view(
    eye: Array, direction: Array, centre: Array, radius: float, half_angle: float, reach: float
) -> bool:
    """Tell whether a whole sphere is in the picture, its centre within reach.

    Args:
        eye: Position of the camera (3,) [m].
        direction: Unit direction in which it looks (3,).
        centre: Centre of the sphere (3,) [m].
        radius: Its radius [m].
        half_angle: Half of the field of view [rad], below pi/2.
        reach: Largest distance at which something is recognised [m].
    """
    way = centre - eye
    distance = float(np.linalg.norm(way))
    if distance <= radius or distance > reach:
        return False
    along = float(way @ direction)
    off = math.atan2(float(np.linalg.norm(way - along * direction)), along)
    return off + math.asin(radius / distance) <= half_angle


def hides(eye: Array, target: Array, centre: Array, radius: float) -> bool:
    """Tell whether a sphere meets the segment from ``eye`` to ``target``, all points (3,) [m]."""
    way = target - eye
    at = float((centre - eye) @ way) / float(way @ way)
    nearest = eye + min(max(at, 0.0), 1.0) * way
    return float(np.linalg.norm(centre - nearest)) < radius
