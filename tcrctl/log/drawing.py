"""What is drawn of a task in viewers, reports and figures: what stands in the world, and what the end sends out.

Task settings -> :mod:`tcrctl.task.drawing` -> Drawing -> ``/scene/static``, report, figures
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tcrctl.signals import Array

Kind = Literal["wall", "hole", "pipe", "screen"]


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed line.

    Attributes:
        kind: What it is an edge of.
        label: What is written beside it; may be empty.
        points: Its corners (n, 3) [m].
    """

    kind: Kind
    label: str
    points: Array


@dataclass(frozen=True, slots=True)
class Ball:
    """An object that is looked for.

    Attributes:
        name: Its name.
        centre: Its middle (3,) [m].
        radius: Its radius [m].
    """

    name: str
    centre: Array
    radius: float


@dataclass(frozen=True, slots=True)
class Passage:
    """A straight bore that a beam shall go through, and the screen behind it.

    Attributes:
        name: Its name.
        entry: Middle of its entry (3,) [m].
        axis: Unit direction from there to the exit (3,).
        length: Distance of the exit [m].
        radius: Radius of the bore [m].
        screen: Distance of the screen from the exit [m].
    """

    name: str
    entry: Array
    axis: Array
    length: float
    radius: float
    screen: float


@dataclass(frozen=True, slots=True)
class Sight:
    """What the end sends along its negative normal: the view of a camera, or a beam.

    Attributes:
        ahead: Where it begins, from the end along it [m].
        half_angle: Half of the field of view [rad]; 0 for a beam.
        reach: How far it goes [m].
    """

    ahead: float
    half_angle: float
    reach: float


@dataclass(frozen=True, slots=True)
class Drawing:
    """Everything that is drawn of a task."""

    outlines: tuple[Outline, ...] = ()
    balls: tuple[Ball, ...] = ()
    passages: tuple[Passage, ...] = ()
    sight: Sight | None = None

    @property
    def corners(self) -> Array:
        """Points that a picture of it must hold (n, 3) [m]."""
        points = [outline.points for outline in self.outlines] + [ball.centre[None] for ball in self.balls]
        return np.concatenate(points) if points else np.zeros((0, 3))


def circle(centre: Array, axis: Array, radius: float, corners: int = 36) -> Array:
    """Return points on a circle (corners, 3) [m].

    Args:
        centre: Its middle (3,) [m].
        axis: Unit vector across it (3,).
        radius: Its radius [m].
        corners: Number of points.
    """
    least = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, least)
    first /= np.linalg.norm(first)
    angle = 2.0 * np.pi * np.arange(corners)[:, None] / corners
    found: Array = centre + radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))
    return found


def cone(sight: Sight, corners: int = 24) -> Array:
    """Return the rim of the view of a camera (corners, 3) [m], in the frame of the end; z is its normal."""
    depth = sight.ahead + sight.reach * np.cos(sight.half_angle)
    down = np.array([0.0, 0.0, -1.0])
    return circle(depth * down, down, sight.reach * np.sin(sight.half_angle), corners)
