"""What of a robot's shape does not change with its pose: sizes of rings, and how each joint holds the next ring.

A module is rigid: its markers say where its apex is. The next ring hangs on that apex by springs, a few millimetres
at most from where it hung at the start, however the robot bends. So

    side    distance between two markers of a ring
    offset  apex of the ring above, in the axes of the ring: x and y sideways, z along the body
    twist   angle of the ring about its normal against the ring above
    bend    normal of the ring above, in the axes of the ring, x and y

Sides and offsets change little on a healthy robot; twist a little more; bends are what the robot moves with.
The fixed base is the first ring. What markers do not show is NaN.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.picture.kernel import Shape, measure
from tcrctl.robot.module import apexes, rings
from tcrctl.robot.ring_axes import ring_frames
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array


class Anatomy(NamedTuple):
    """What the markers of a robot do not show.

    Attributes:
        base: Ring nodes of the base (3, 3) [m].
        apex: Apex of every module but the last in the axes of its ring, base first (n, 3) [m].
    """

    base: Array
    apex: Array


def anatomy_of(robot: Robot) -> Anatomy:
    """Return the anatomy of a robot at rest."""
    nodes = robot.rest.q.reshape(-1, 3)
    corners = rings(nodes)
    arm = apexes(nodes) - corners.mean(axis=1)
    apex = np.einsum("nij,nj->ni", ring_frames(corners.reshape(-1, 3)), arm)
    return Anatomy(corners[0].copy(), apex[:-1])


def shape_of(anatomy: Anatomy, markers: Array, seen: NDArray[np.bool_]) -> Shape:
    """Return the shape that markers show.

    Args:
        anatomy: What they do not show.
        markers: All ring nodes (3 n, 3) [m].
        seen: Which of them count (3 n,).
    """
    writable = np.array(seen)  # those of some frames are not, which would be another kernel
    return Shape(*measure(anatomy.base, anatomy.apex, markers, writable))


def completed(known: Shape, shape: Shape) -> Shape:
    """Return a shape with what it does not know taken from another one."""
    return Shape(*(np.where(np.isnan(a), b, a) for a, b in zip(known, shape, strict=True)))


def median_shape(shapes: list[Shape]) -> Shape:
    """Return the median of shapes of a robot that stands still; NaN for what none of them shows.

    Twists are taken as differences to the first that shows them.
    """
    first = shapes[0]
    for shape in shapes[1:]:
        first = completed(first, shape)
    changes = [shape.since(first) for shape in shapes]
    return Shape(*(a + _median([c[i] for c in changes]) for i, a in enumerate(first)))


def _median(changes: list[Array]) -> Array:
    stacked = np.array(changes)
    nobody = np.isnan(stacked).all(axis=0)
    return np.asarray(np.nanmedian(np.where(nobody, 0.0, stacked), axis=0))
