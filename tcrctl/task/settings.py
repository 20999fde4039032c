"""What a ``task:`` section may say: laser through pipes, camera into a box."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from statistics import fmean, median
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import AfterValidator, Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import Settings, quantity, refuse
from tcrctl.trajectory.values import NotNegative, Positive, Vector, not_empty

#: How far markers may lie off the symmetry that the pose is computed from [mm].
SYMMETRY_MM: Final = 1.0

#: Names of what is found for every target, and for a box as a whole; numbers and flags only.
TARGET_RESULTS: Final = (
    "position_error_mm",
    "theta_x_error_rad",
    "theta_y_error_rad",
    "beam_passes",
    "bore_clearance_mm",
    "spot_offset_mm",
    "dwell_s",
)
BOX_RESULTS: Final = ("detected", "detection_s", "collision", "collision_s", "smallest_clearance_mm")

Label: TypeAlias = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)]
Wall: TypeAlias = Literal["left", "right", "front", "back", "bottom", "top"]
#: Axis of the box that each wall is across, and on which side of the inside the wall is.
WALLS: Final[dict[Wall, tuple[int, int]]] = {
    "left": (0, -1),
    "right": (0, 1),
    "front": (1, -1),
    "back": (1, 1),
    "bottom": (2, -1),
    "top": (2, 1),
}


def _middle(points: Sequence[Vector]) -> Vector:
    x, y, z = (fmean(values) for values in zip(*points, strict=True))
    return x, y, z


def _three_or_more(markers: tuple[Vector, ...]) -> tuple[Vector, ...]:
    if len(markers) < 3:
        raise ValueError(f"needs at least 3 markers, it has {len(markers)}")
    around = [math.dist(marker, _middle(markers)) for marker in markers]
    usual = median(around)
    worst = max(range(len(around)), key=lambda i: abs(around[i] - usual))
    if abs(around[worst] - usual) > SYMMETRY_MM:
        others = f"the others are {usual:.4g} mm from it"
        raise ValueError(
            f"marker {worst + 1} is {around[worst]:.4g} mm from the centre of all, {others}; they must be spread "
            "evenly around the axis"
        )
    if usual < SYMMETRY_MM:
        raise ValueError("the markers are all in one place")
    return markers


def _in_order(markers: tuple[Vector, Vector, Vector, Vector]) -> tuple[Vector, Vector, Vector, Vector]:
    _three_or_more(markers)
    across = 2.0 * median(math.dist(marker, _middle(markers)) for marker in markers)
    for i in (0, 1):
        found = math.dist(markers[i], markers[i + 2])
        if abs(found - across) > 2.0 * SYMMETRY_MM:
            raise ValueError(
                f"markers {i + 1} and {i + 3} must face each other across the middle, {across:.4g} mm apart; they "
                f"are {found:.4g} mm apart"
            )
    return markers


MarkerRing: TypeAlias = Annotated[tuple[Vector, ...], AfterValidator(_three_or_more)]


class PipeSettings(Settings):
    """A straight pipe; markers evenly around its entry and around its exit say where it is."""

    name: Label
    entry_markers_mm: MarkerRing = quantity("mm", "three markers or more around the entry, world frame")
    exit_markers_mm: MarkerRing = quantity("mm", "three markers or more around the exit, world frame")
    bore_mm: Positive = quantity("mm", "inner diameter")
    standoff_mm: Positive = quantity("mm", "target: so far before the entry, on the axis", 50.0)
    screen_mm: NotNegative = quantity("mm", "the beam's spot is looked at on a screen so far behind", 100.0)

    @model_validator(mode="after")
    def _has_length(self) -> PipeSettings:
        if math.dist(_middle(self.entry_markers_mm), _middle(self.exit_markers_mm)) < SYMMETRY_MM:
            raise ValueError("entry and exit are the same place")
        return self


class LaserPipeSettings(Settings):
    """A laser at the end, along its negative normal, is pointed through pipes; the targets are their names."""

    kind: Literal["laser_pipe"]
    pipes: Annotated[tuple[PipeSettings, ...], AfterValidator(not_empty)] = Field(
        description="the pipes, at least one"
    )
    beam_mm: NotNegative = quantity("mm", "diameter of the beam", 1.0)
    marker_noise_um: NotNegative = quantity(
        "um", "standard deviation of every marker coordinate that the targets are computed from", 0.0
    )

    @model_validator(mode="after")
    def _fits(self) -> LaserPipeSettings:
        refuse(_repeated("pipes", [pipe.name for pipe in self.pipes]))
        refuse(
            (("pipes", i, "bore_mm"), f"must be more than beam_mm, {self.beam_mm:g}, not {pipe.bore_mm:g}")
            for i, pipe in enumerate(self.pipes)
            if pipe.bore_mm <= self.beam_mm
        )
        return self

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names that a trajectory can go to."""
        return tuple(pipe.name for pipe in self.pipes)

    @property
    def result_names(self) -> tuple[str, ...]:
        """Dotted names of the numbers and flags in the result."""
        return tuple(f"targets.{i}.{name}" for i in range(len(self.pipes)) for name in TARGET_RESULTS)


class BoxHoleSettings(Settings):
    """A round hole in a wall of the box."""

    name: Label
    wall: Wall = Field(description="the wall it is in; left is the one with the markers")
    diameter_mm: Positive = quantity("mm", "diameter")
    center_mm: tuple[float, float] = quantity(
        "mm", "centre on the wall from its middle, along the first and second of (x, y, z) in it", (0.0, 0.0)
    )
    standoff_mm: NotNegative = quantity("mm", "target: the end so far outside, on the hole's axis", 25.0)


class BoxSettings(Settings):
    """A closed box with holes.

    Its frame: origin in the middle of the left wall, x into the box, z up, y to the left of who looks in. Walls:
    left and right at the ends of x, front and back at those of y, bottom and top at those of z.
    """

    markers_mm: Annotated[tuple[Vector, Vector, Vector, Vector], AfterValidator(_in_order)] = quantity(
        "mm",
        "markers on the left wall around its middle, world frame, clockwise from top left as seen from outside",
    )
    size_mm: tuple[Positive, Positive, Positive] = quantity("mm", "depth along x, width along y, height")
    wall_mm: NotNegative = quantity("mm", "thickness of the walls, half of it on either side", 3.0)
    holes: Annotated[tuple[BoxHoleSettings, ...], AfterValidator(not_empty)] = Field(
        description="the holes, at least one"
    )

    @model_validator(mode="after")
    def _holes_fit(self) -> BoxSettings:
        refuse(_repeated("holes", [hole.name for hole in self.holes]))
        refuse(self._misfits())
        return self

    def sides_mm(self, wall: Wall) -> tuple[float, float]:
        """Return both sides of a wall [mm], in the order of x, y, z."""
        across, _ = WALLS[wall]
        first, second = (size for axis, size in enumerate(self.size_mm) if axis != across)
        return first, second

    def _misfits(self) -> Iterator[Finding]:
        for i, hole in enumerate(self.holes):
            for side, centre in zip(self.sides_mm(hole.wall), hole.center_mm, strict=True):
                if abs(centre) + hole.diameter_mm / 2.0 >= side / 2.0:
                    yield ("holes", i), f"does not lie within the {hole.wall} wall, side {side:g} mm"
                    break
            for other in self.holes[:i]:
                gap = math.dist(hole.center_mm, other.center_mm)
                if other.wall == hole.wall and 2.0 * gap <= hole.diameter_mm + other.diameter_mm:
                    yield ("holes", i), f"overlaps the hole {other.name}"


class CameraSettings(Settings):
    """A camera at the end that looks along its negative normal, with a round picture."""

    field_of_view_deg: float = quantity("deg", "full angle of the picture", gt=0.0, lt=180.0)
    range_mm: Positive = quantity("mm", "largest distance at which an object is recognised")
    ahead_mm: float = quantity("mm", "from the end position to the camera, along the view", 0.0)


class ObjectSettings(Settings):
    """Something in the box, as a ball."""

    name: Label
    position_mm: Vector = quantity("mm", "its middle in the frame of the box")
    diameter_mm: Positive = quantity("mm", "diameter")


class BoxInspectionSettings(Settings):
    """A camera at the end looks for objects in a box that nothing of the robot may touch.

    The targets are the names of the holes. What is first seen after a collision does not count: a robot that has
    hit the box would have been stopped.
    """

    kind: Literal["box_inspection"]
    box: BoxSettings
    camera: CameraSettings
    objects: Annotated[tuple[ObjectSettings, ...], AfterValidator(not_empty)] = Field(
        description="what is looked for, at least one"
    )
    marker_noise_um: NotNegative = quantity(
        "um", "standard deviation of every marker coordinate that the targets are computed from", 0.0
    )

    @model_validator(mode="after")
    def _objects_fit(self) -> BoxInspectionSettings:
        refuse(_repeated("objects", [item.name for item in self.objects]))
        refuse(
            (("objects", i, "position_mm"), "the object is not inside the box")
            for i, item in enumerate(self.objects)
            if not _inside(item, self.box.size_mm)
        )
        return self

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names that a trajectory can go to."""
        return tuple(hole.name for hole in self.box.holes)

    @property
    def result_names(self) -> tuple[str, ...]:
        """Dotted names of the numbers and flags in the result."""
        each = (f"objects.{i}.{n}" for i in range(len(self.objects)) for n in ("detected", "first_seen_s"))
        return (*each, *BOX_RESULTS)


TaskSettings: TypeAlias = Annotated[LaserPipeSettings | BoxInspectionSettings, Field(discriminator="kind")]
"""Union of all kinds of task, told apart by ``kind``."""


def _inside(item: ObjectSettings, size_mm: Vector) -> bool:
    (x, y, z), (depth, width, height), r = item.position_mm, size_mm, item.diameter_mm / 2.0
    return r <= x <= depth - r and abs(y) <= width / 2.0 - r and abs(z) <= height / 2.0 - r


def _repeated(key: str, names: Sequence[str]) -> Iterator[Finding]:
    seen = Counter[str]()
    for i, name in enumerate(names):
        seen[name] += 1
        if seen[name] > 1:
            yield (key, i, "name"), f"the name {name} is taken already"
