"""A ray that goes through a straight bore, or does not."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tcrctl.signals import Array


class Bore(NamedTuple):
    """A straight cylindrical hole with open ends.

    Attributes:
        entry: Centre of the end that is entered (3,) [m].
        axis: Unit direction from the entry to the exit (3,).
        length: Distance from entry to exit [m].
        radius: Radius [m].
    """

    entry: Array
    axis: Array
    length: float
    radius: float


def plane_hit(origin: Array, direction: Array, point: Array, normal: Array) -> float:
    """Return the distance along a ray to a plane.

    Args:
        origin: Where the ray begins (3,) [m].
        direction: Unit direction of the ray (3,).
        point: A point of the plane (3,) [m].
        normal: Normal of the plane (3,), of any length but 0.

    Returns:
        The distance [m]; inf if the ray does not meet the plane.
    """
    approach = float(direction @ normal)
    height = float((point - origin) @ normal)
    if height == 0.0:
        return 0.0
    return height / approach if height * approach > 0.0 else math.inf


def off_axis(origin: Array, direction: Array, bore: Bore, depth: float) -> float:
    """Return the distance of a ray from the axis of a bore where it is ``depth`` [m] behind the entry [m].

    Inf if the ray never gets there.
    """
    centre = bore.entry + depth * bore.axis
    distance = plane_hit(origin, direction, centre, bore.axis)
    if not math.isfinite(distance):
        return math.inf
    return float(np.linalg.norm(origin + distance * direction - centre))


def clearance(origin: Array, direction: Array, bore: Bore) -> float:
    """Return smallest distance of a ray from the wall of a bore that it goes through, from the entry to the exit.

    Between two cross sections the distance from the axis is a convex function of the depth, so that it is largest
    at one of them.

    Args:
        origin: Where the ray begins, before the entry (3,) [m].
        direction: Unit direction (3,).
        bore: The bore.

    Returns:
        The distance [m]; negative by what the ray is off if it does not go through, -inf if it goes elsewhere.
    """
    if float(direction @ bore.axis) <= 0.0 or float((origin - bore.entry) @ bore.axis) > 0.0:
        return -math.inf
    ends = (off_axis(origin, direction, bore, depth) for depth in (0.0, bore.length))
    return bore.radius - max(ends)
