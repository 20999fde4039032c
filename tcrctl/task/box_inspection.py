"""``kind: box_inspection``: which objects in a box the camera sees, and whether the robot touches the box."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from tcrctl.log.event import Event
from tcrctl.signals import Array, StepRecord
from tcrctl.task.body import segment_name, segments
from tcrctl.task.box import Box, box_from_markers
from tcrctl.task.perforated_plate import blocks, nearest
from tcrctl.task.settings import WALLS, BoxInspectionSettings
from tcrctl.task.sight import hides, in_view
from tcrctl.trajectory.pose_path import MM, EndPose

#: Parts of the robot farther from the walls than this are of no interest [m].
FARTHEST: Final = 1.0
#: By how much a clearance may be found too large [m].
TOLERANCE: Final = 1e-5


class BoxInspection:
    """Looks through the camera and watches the walls, step by step."""

    def __init__(self, settings: BoxInspectionSettings, box: Box, thickness: float) -> None:
        """Prepare.

        Args:
            settings: Camera and objects.
            box: The box where it is.
            thickness: Diameter of the robot's rods and rings [m].
        """
        camera, objects = settings.camera, settings.objects
        self._box, self._margin = box, 0.5 * (thickness + box.thickness)
        self._half_angle = math.radians(camera.field_of_view_deg / 2.0)
        self._reach, self._ahead = MM * camera.range_mm, MM * camera.ahead_mm
        self._names = [item.name for item in objects]
        self._centres = box.place(np.array([item.position_mm for item in objects]))
        self._radii = [MM * item.diameter_mm / 2.0 for item in objects]
        self._seen: dict[str, float] = {}
        self._clearance, self._touch = math.inf, ""
        self._collision: float | None = None
        blocks(box.walls, box.origin, box.origin)  # compiled now, not when the first object comes into view

    def observe(self, step: StepRecord) -> list[Event]:
        """Take a step; return events: the first sight of an object, the first collision."""
        end, q = (step.estimate, step.estimate.q) if step.truth is None else (step.truth, step.truth.q)
        events = self._watch_walls(step.t, q)
        if self._collision is None:
            for name in self._in_sight(end.position - self._ahead * end.normal, -end.normal):
                if name not in self._seen:
                    self._seen[name] = step.t
                    events.append(Event(step.t, "task", "info", f"{name} is seen for the first time"))
        return events

    def _watch_walls(self, t: float, q: Array) -> list[Event]:
        start, end = segments(q)
        distance, segment, wall = nearest(self._box.walls, start, end, FARTHEST, TOLERANCE)
        clearance = distance - self._margin
        self._clearance = min(self._clearance, clearance)
        if clearance > 0.0 or self._collision is not None:
            return []
        self._collision = t
        self._touch = f"{segment_name(segment)}, {list(WALLS)[wall]} wall"
        return [Event(t, "task", "error", f"collision with the box: {self._touch}")]

    def _in_sight(self, eye: Array, direction: Array) -> list[str]:
        return [
            name
            for i, (name, centre, radius) in enumerate(
                zip(self._names, self._centres, self._radii, strict=True)
            )
            if in_view(eye, direction, centre, radius, self._half_angle, self._reach)
            and not blocks(self._box.walls, eye, centre)
            and not self._is_hidden(i, eye)
        ]

    def _is_hidden(self, i: int, eye: Array) -> bool:
        """Tell whether the middle of object ``i`` is behind another object."""
        others = [j for j in range(len(self._names)) if j != i]
        return any(hides(eye, self._centres[i], self._centres[j], self._radii[j]) for j in others)

    def result(self) -> dict[str, Any]:
        """Return what was seen before any collision, and the first collision."""
        complete = len(self._seen) == len(self._names)
        return {
            "objects": [
                {"name": name, "detected": name in self._seen, "first_seen_s": self._seen.get(name)}
                for name in self._names
            ],
            "detected": len(self._seen),
            "detection_s": max(self._seen.values()) if complete else None,
            "collision": self._collision is not None,
            "collision_s": self._collision,
            "collision_between": self._touch or None,
            "smallest_clearance_mm": self._clearance / MM if math.isfinite(self._clearance) else None,
        }


def build_box_inspection(
    settings: BoxInspectionSettings, targets: Mapping[str, EndPose], rod_diameter: float
) -> BoxInspection:
    """Build the task; see :class:`tcrctl.task.task.Kind`."""
    del targets
    return BoxInspection(settings, box_from_markers(settings.box), rod_diameter)
