"""What a ``trajectory:`` section may say: one model per kind, units in the key names."""

from __future__ import annotations

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, field_validator, model_validator

from tcrctl.config.settings import Settings, quantity
from tcrctl.trajectory.drive_settings import DrivesSettings
from tcrctl.trajectory.excitation_settings import ExcitationSettings
from tcrctl.trajectory.pose_settings import RevolutionSettings, ScanSettings, WaypointsSettings
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.table_settings import TableSettings
from tcrctl.trajectory.values import NotNegative, Positive, Vector, check_one_of, not_empty

JOIN_TOLERANCE_MM = 1e-6
AXIS_TOLERANCE = 1e-3  # axes typed with four decimals pass; the builder makes them exactly orthonormal

Point: TypeAlias = tuple[float, float]


def _checked_line(line: tuple[Point, ...]) -> tuple[Point, ...]:
    if len(line) < 2:
        raise ValueError(f"a line needs at least 2 points, it has {len(line)}")
    for i in range(1, len(line)):
        if math.dist(line[i - 1], line[i]) <= JOIN_TOLERANCE_MM:
            raise ValueError(f"points {i} and {i + 1} are the same: ({line[i][0]:g}, {line[i][1]:g}) mm")
    return line


Polyline: TypeAlias = Annotated[tuple[Point, ...], AfterValidator(_checked_line)]


class ArcSettings(Settings):
    """Circular arc; counter-clockwise when ``to_deg`` is larger than ``from_deg``, else clockwise."""

    center: Point = quantity("mm", "centre in the drawing plane")
    radius: Positive = quantity("mm", "radius")
    from_deg: float = quantity("deg", "angle of the first point, from the plane's x axis")
    to_deg: float = quantity("deg", "angle of the last point")

    @model_validator(mode="after")
    def _has_length(self) -> ArcSettings:
        if self.radius * math.radians(abs(self.to_deg - self.from_deg)) <= JOIN_TOLERANCE_MM:
            raise ValueError(f"the arc has no length: from_deg = {self.from_deg:g}, to_deg = {self.to_deg:g}")
        return self

    def at(self, angle_deg: float) -> Point:
        """Return the point of the circle at an angle [mm]."""
        angle = math.radians(angle_deg)
        return (
            self.center[0] + self.radius * math.cos(angle),
            self.center[1] + self.radius * math.sin(angle),
        )


class SegmentSettings(Settings):
    """One part of a composite stroke: exactly one of ``line`` and ``arc``."""

    line: Polyline | None = quantity("mm", "corner points of a polyline, two or more", None)
    arc: ArcSettings | None = Field(default=None, description="circular arc")

    @model_validator(mode="after")
    def _one_shape(self) -> SegmentSettings:
        check_one_of({"line": self.line, "arc": self.arc})
        return self

    @property
    def ends(self) -> tuple[Point, Point]:
        """First and last point [mm]."""
        if self.arc is not None:
            return self.arc.at(self.arc.from_deg), self.arc.at(self.arc.to_deg)
        assert self.line is not None
        return self.line[0], self.line[-1]


class StrokeSettings(Settings):
    """One uninterrupted stroke: exactly one of ``line``, ``arc`` and ``path``."""

    line: Polyline | None = quantity("mm", "corner points of a polyline, two or more", None)
    arc: ArcSettings | None = Field(default=None, description="circular arc")
    path: Annotated[tuple[SegmentSettings, ...], AfterValidator(not_empty)] | None = Field(
        default=None, description="lines and arcs one after the other; each begins where the last one ends"
    )

    @field_validator("path")
    @classmethod
    def _ends_join(cls, path: tuple[SegmentSettings, ...] | None) -> tuple[SegmentSettings, ...] | None:
        for i in range(1, len(path or ())):
            assert path is not None
            end, start = path[i - 1].ends[1], path[i].ends[0]
            if math.dist(end, start) > JOIN_TOLERANCE_MM:
                raise ValueError(
                    f"segment {i + 1} starts at ({start[0]:.7f}, {start[1]:.7f}) mm, but segment {i} ends at "
                    f"({end[0]:.7f}, {end[1]:.7f}) mm; they must join within {JOIN_TOLERANCE_MM:g} mm"
                )
        return path

    @model_validator(mode="after")
    def _one_shape(self) -> StrokeSettings:
        check_one_of({"line": self.line, "arc": self.arc, "path": self.path})
        return self

    @property
    def segments(self) -> tuple[SegmentSettings, ...]:
        """The stroke as a sequence of lines and arcs."""
        return self.path if self.path is not None else (SegmentSettings(line=self.line, arc=self.arc),)


class PlaneSettings(Settings):
    """Where the drawing lies: its origin is the rest end position plus an offset."""

    offset_mm: Vector = quantity("mm", "drawing origin minus rest end position, world frame", (0.0, 0.0, 0.0))
    x_axis: Vector = quantity("1", "direction of the drawing's x axis, world frame", (1.0, 0.0, 0.0))
    y_axis: Vector = quantity("1", "direction of the drawing's y axis, world frame", (0.0, 1.0, 0.0))

    @model_validator(mode="after")
    def _axes_are_orthonormal(self) -> PlaneSettings:
        for name, axis in (("x_axis", self.x_axis), ("y_axis", self.y_axis)):
            if abs(math.hypot(*axis) - 1.0) > AXIS_TOLERANCE:
                raise ValueError(f"{name} must have length 1, it has {math.hypot(*axis):.6g}")
        product = sum(a * b for a, b in zip(self.x_axis, self.y_axis, strict=True))
        if abs(product) > AXIS_TOLERANCE:
            raise ValueError(
                f"x_axis and y_axis must be perpendicular, their scalar product is {product:.6g}"
            )
        return self


class StrokesSettings(TrajectorySection):
    """A drawing in a plane: strokes in order, joined by straight travel moves; position only."""

    kind: Literal["strokes"]
    plane: PlaneSettings = Field(default_factory=PlaneSettings, description="where the drawing lies")
    strokes: Annotated[tuple[StrokeSettings, ...], AfterValidator(not_empty)] = Field(
        description="strokes in drawing order, at least one"
    )
    speed_limit_mm_s: Positive = quantity("mm/s", "peak speed while drawing", 20.0)
    travel_speed_limit_mm_s: Positive = quantity("mm/s", "peak speed of approach and travel moves", 25.0)
    acceleration_limit_mm_s2: Positive = quantity(
        "mm/s2", "peak acceleration, tangential and centripetal together", 30.0
    )
    ramp_s: Positive = quantity("s", "shortest duration of any change of speed", 1.2)
    corner: Literal["stop", "round"] = Field(
        default="stop",
        description="come to rest at corners, or replace them by an arc (where it does not fit: stop)",
    )
    corner_angle_deg: NotNegative = quantity(
        "deg", "change of direction from which on a join is a corner", 5.0, lt=180.0
    )
    corner_radius_mm: Positive = quantity("mm", "radius of the arc of corner: round", 3.0)
    lead_in_s: NotNegative = quantity("s", "rest at the start pose before the first move", 1.0)
    dwell_s: NotNegative = quantity("s", "rest after every stroke", 0.5)
    settle_s: NotNegative = quantity("s", "rest at the very end, after the last dwell", 2.0)


class HoldSettings(TrajectorySection):
    """Stand still at the rest pose, or beside it."""

    kind: Literal["hold"]
    duration_s: Positive = quantity("s", "how long")
    offset_mm: Vector = quantity(
        "mm", "target minus rest end position, world frame; a step input if not zero", (0.0, 0.0, 0.0)
    )
    orientation: Literal["free", "rest"] = Field(
        default="free", description="free: position only; rest: the end normal of the rest pose is wanted too"
    )


TrajectorySettings: TypeAlias = Annotated[
    StrokesSettings
    | HoldSettings
    | WaypointsSettings
    | RevolutionSettings
    | ScanSettings
    | DrivesSettings
    | ExcitationSettings
    | TableSettings,
    Field(discriminator="kind"),
]
"""Union of all kinds of trajectory, told apart by ``kind``; see :data:`tcrctl.trajectory.trajectory.KINDS`."""
