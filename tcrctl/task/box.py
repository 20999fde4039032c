"""Where a box is, from the four markers around its left hole, [TCR, Sec. V.F, Fig. 20]; its walls and holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcrctl.signals import Array
from tcrctl.task.perforated_plate import Plates
from tcrctl.task.pipe import Seen, exactly
from tcrctl.task.settings import WALLS, BoxHoleSettings, BoxInspectionSettings, BoxSettings
from tcrctl.trajectory.pose_path import MM, EndPose, unit


@dataclass(frozen=True, slots=True)
class Box:
    """A box in the world.

    Attributes:
        origin: Middle of the left wall (3,) [m].
        frame: Rows: x into the box, y to the left of who looks in, z up (3, 3).
        walls: Its walls, in the order of ``WALLS``.
        thickness: Of the walls [m].
    """

    origin: Array
    frame: Array
    walls: Plates
    thickness: float

    def place(self, position_mm: Array) -> Array:
        """Return points given in the frame of the box (n, 3) [mm] in the world (n, 3) [m]."""
        placed: Array = self.origin + MM * position_mm @ self.frame
        return placed


def box_from_markers(settings: BoxSettings, seen: Seen = exactly) -> Box:
    """Compute a box.

    Args:
        settings: The box and its markers.
        seen: How the markers are seen.
    """
    top_left, top_right, low_right, low_left = markers = seen(MM * np.array(settings.markers_mm))
    up = top_left + top_right - low_left - low_right
    right = top_right + low_right - top_left - low_left
    into = unit(np.cross(up, right))
    left = unit(np.cross(up, into))
    frame = np.stack((into, left, np.cross(into, left)))
    origin = markers.mean(axis=0)
    return Box(origin, frame, _walls(settings, origin, frame), MM * settings.wall_mm)


def hole_target(settings: BoxSettings, box: Box, hole: BoxHoleSettings) -> EndPose:
    """Return the pose of the end outside a hole, looking in."""
    wall = list(WALLS).index(hole.wall)
    along, across, inward = box.walls.frame[wall]
    centre = box.walls.middle[wall] + MM * (hole.center_mm[0] * along + hole.center_mm[1] * across)
    return EndPose(centre - MM * hole.standoff_mm * inward, -inward)


def hole_targets(settings: BoxInspectionSettings, seen: Seen) -> dict[str, EndPose]:
    """Return the pose before every hole, by its name, from the markers of the box as they are seen."""
    box = box_from_markers(settings.box, seen)
    return {hole.name: hole_target(settings.box, box, hole) for hole in settings.box.holes}


def _walls(settings: BoxSettings, origin: Array, frame: Array) -> Plates:
    middles = []
    frames = []
    halves = []
    holes = []
    first = [0]
    centre = origin + 0.5 * MM * settings.size_mm[0] * frame[0]
    for wall, (axis, side) in WALLS.items():
        out = side * frame[axis]
        others = [frame[other] for other in range(3) if other != axis]
        middles.append(centre + 0.5 * MM * settings.size_mm[axis] * out)
        frames.append(np.stack((*others, -out)))
        halves.append([0.5 * MM * size for size in settings.sides_mm(wall)])
        own = [hole for hole in settings.holes if hole.wall == wall]
        holes += [MM * np.array((*hole.center_mm, hole.diameter_mm / 2.0)) for hole in own]
        first.append(len(holes))
    return Plates(
        np.array(middles), np.array(frames), np.array(halves), np.array(first), np.array(holes).reshape(-1, 3)
    )
