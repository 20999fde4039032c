"""What a ``trajectory:`` section may say where the orientation counts: waypoints, revolution, scan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import AfterValidator, Field, field_validator, model_validator

from tcrctl.config.keys import Keys
from tcrctl.config.settings import Settings, quantity
from tcrctl.trajectory.section import Placed, TrajectorySection
from tcrctl.trajectory.values import Direction, NotNegative, Positive, Vector, check_one_of, not_empty

Span: TypeAlias = tuple[float, float]
"""Value at the start and at the end."""


class PlaceSettings(Settings):
    """A place of the end: exactly one of ``offset_mm``, ``position_mm`` and ``target``."""

    offset_mm: Vector | None = quantity("mm", "place minus rest end position, world frame", None)
    position_mm: Vector | None = quantity("mm", "place in the world frame", None)
    target: str | None = Field(default=None, description="name of a target of the task, with its direction")

    @model_validator(mode="after")
    def _one_place(self) -> PlaceSettings:
        places = {"offset_mm": self.offset_mm, "position_mm": self.position_mm, "target": self.target}
        check_one_of(places)
        return self


class WaypointSettings(PlaceSettings):
    """A pose to stop at: a place and, unless the orientation is free, one way to give it."""

    normal: Direction | None = quantity("1", "unit end normal, +z at rest", None)
    theta_deg: tuple[float, float] | None = quantity(
        "deg", "orientation angles (theta_x, theta_y) of (45), both 0 at rest", None
    )
    face_target: bool = Field(
        default=True, description="with a target: look the way it says; false leaves the orientation free"
    )
    dwell_s: NotNegative | None = quantity("s", "rest there; that of the section if left out", None)

    @field_validator("theta_deg")
    @classmethod
    def _in_range(cls, theta: tuple[float, float] | None) -> tuple[float, float] | None:
        if theta is not None and abs(theta[1]) > 90.0:
            raise ValueError(f"theta_y must be within -90 and 90, it is {theta[1]:g}")
        return theta

    @model_validator(mode="after")
    def _one_orientation(self) -> WaypointSettings:
        check_one_of({"normal": self.normal, "theta_deg": self.theta_deg}, at_most=True)
        if self.target is not None and (self.normal is not None or self.theta_deg is not None):
            raise ValueError(
                f"the target {self.target} has its own direction; leave out normal and theta_deg"
            )
        return self

    @property
    def oriented(self) -> bool:
        """Whether the pose has an orientation."""
        faces = self.target is not None and self.face_target
        return faces or self.normal is not None or self.theta_deg is not None

    def with_target(self, poses: Mapping[str, Placed]) -> WaypointSettings:
        """Return the waypoint at the pose of its target, if it has one."""
        if self.target is None:
            return self
        place, normal = poses[self.target]
        found = {"target": None, "position_mm": place, "normal": normal if self.face_target else None}
        return self.model_copy(update=found)


class WaypointsSettings(TrajectorySection):
    """From the rest pose through poses, each leg from rest to rest: straight, the normal on a great circle."""

    kind: Literal["waypoints"]
    points: Annotated[tuple[WaypointSettings, ...], AfterValidator(not_empty)] = Field(
        description="poses in order, at least one; all with or all without orientation"
    )
    cycles: int = Field(default=1, ge=1, le=1000, description="how often they are gone through")
    speed_limit_mm_s: Positive = quantity("mm/s", "peak speed", 20.0)
    acceleration_limit_mm_s2: Positive = quantity("mm/s2", "peak acceleration", 30.0)
    angular_speed_limit_deg_s: Positive = quantity("deg/s", "peak angular speed of the normal", 5.0)
    angular_acceleration_limit_deg_s2: Positive = quantity(
        "deg/s2", "peak angular acceleration of the normal along its path", 5.0
    )
    ramp_s: Positive = quantity("s", "shortest duration of any change of speed", 2.0)
    lead_in_s: NotNegative = quantity("s", "rest at the start pose before the first move", 1.0)
    dwell_s: NotNegative = quantity("s", "rest at every waypoint", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the very end, after the last dwell", 2.0)

    @model_validator(mode="after")
    def _alike(self) -> WaypointsSettings:
        for i, point in enumerate(self.points[1:], start=2):
            if point.oriented != self.points[0].oriented:
                has, first = (("no", "has one"), ("an", "has none"))[point.oriented]
                raise ValueError(f"waypoint {i} has {has} orientation, but waypoint 1 {first}")
        return self

    def named_targets(self) -> Iterator[tuple[Keys, str]]:
        """Yield place and name of the target of every waypoint that has one."""
        for i, point in enumerate(self.points):
            if point.target is not None:
                yield ("points", i, "target"), point.target

    def with_targets(self, poses: Mapping[str, Placed]) -> Self:
        """Return the section with every waypoint at its place."""
        return self.model_copy(update={"points": tuple(point.with_target(poses) for point in self.points)})


class RevolutionSettings(TrajectorySection):
    """From the rest pose to a start pose, then turning about a vertical axis, then back to rest if wanted.

    At the angle a the end stands at the axis + radius * (cos a, sin a) + height; radius, height and tilt change
    in proportion to the angle turned. Radius 0 turns about a fixed point, a constant radius and a changing
    height give a helix, both changing a spiral on a cone frustum.
    """

    kind: Literal["revolution"]
    offset_mm: Vector = quantity(
        "mm", "point of the axis at height 0 minus rest end position, world frame", (0.0, 0.0, 0.0)
    )
    radius_mm: Span = quantity("mm", "radius at the start and at the end", (0.0, 0.0))
    height_mm: Span = quantity("mm", "height at the start and at the end", (0.0, 0.0))
    tilt_deg: Span = quantity("deg", "angle between normal and vertical at the start and at the end")
    lean: Literal["outward", "inward"] = Field(
        description="outward: the normal (+z at rest) leans away from the axis; inward: towards it, so that "
        "the end looks outward"
    )
    start_deg: float = quantity("deg", "angle at the start, from the world's x axis", 0.0)
    turns: float = quantity("1", "number of turns, counter-clockwise from above; negative: clockwise", 1.0)
    turn_s: Positive = quantity("s", "duration of one turn at full angular speed")
    ramp_s: Positive = quantity("s", "duration of starting and of stopping to turn", 3.0)
    blend_in_s: Positive = quantity("s", "duration of the move from the rest pose to the start pose")
    blend_out_s: NotNegative = quantity("s", "duration of the move back to the rest pose; 0: stay", 0.0)
    lead_in_s: NotNegative = quantity("s", "rest before the first move", 1.0)
    dwell_s: NotNegative = quantity("s", "rest before turning and after it", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the very end", 2.0)

    @field_validator("radius_mm")
    @classmethod
    def _radius_not_negative(cls, radius: Span) -> Span:
        if min(radius) < 0.0:
            raise ValueError(f"must be >= 0, not {min(radius):g}")
        return radius

    @field_validator("tilt_deg")
    @classmethod
    def _tilt_in_range(cls, tilt: Span) -> Span:
        if not 0.0 <= min(tilt) <= max(tilt) <= 180.0:
            raise ValueError("must be within 0 and 180; lean says in which direction")
        return tilt

    @model_validator(mode="after")
    def _time_to_turn(self) -> RevolutionSettings:
        if self.ramp_s > abs(self.turns) * self.turn_s:
            raise ValueError(
                f"ramp_s, {self.ramp_s:g}, must be at most turns * turn_s, {abs(self.turns) * self.turn_s:g}"
            )
        return self


class HoleSettings(PlaceSettings):
    """Where the end stops in front of a hole, and the direction into the hole."""

    axis: Direction | None = quantity(
        "1", "unit vector into the hole; the end looks along it, its normal against it", None
    )

    @model_validator(mode="after")
    def _one_direction(self) -> HoleSettings:
        check_one_of({"axis": self.axis, "target": self.target})
        return self


class ScanSettings(TrajectorySection):
    """Four stages: go to a hole, tilt the normal off its axis, turn it once about the axis, tilt it back."""

    kind: Literal["scan"]
    hole: HoleSettings = Field(description="the hole that is looked through")
    tilt_deg: float = quantity("deg", "angle between normal and axis while scanning", gt=0.0, lt=90.0)
    start_deg: float = quantity(
        "deg",
        "direction in which the normal tilts first: angle about the axis from straight up "
        "(from the world's x axis if the hole looks straight up or down)",
        0.0,
    )
    turn: Literal["counter_clockwise", "clockwise"] = Field(
        default="counter_clockwise", description="sense of the turn seen against the end's normal"
    )
    approach_s: Positive = quantity("s", "duration of the 1st stage, without the insertion")
    insert_mm: NotNegative = quantity(
        "mm", "last part of the 1st stage, straight along the hole's axis with the end looking along it", 0.0
    )
    insert_s: NotNegative = quantity("s", "duration of the insertion", 0.0)
    tilt_s: Positive = quantity("s", "duration of the 2nd stage")
    turn_s: Positive = quantity("s", "duration of the 3rd stage, ramps included")
    return_s: Positive = quantity("s", "duration of the 4th stage")
    ramp_s: Positive = quantity("s", "duration of starting and of stopping to turn", 3.0)
    lead_in_s: NotNegative = quantity("s", "rest before the first stage", 0.0)
    settle_s: NotNegative = quantity("s", "rest after the last stage", 0.0)

    @model_validator(mode="after")
    def _time_to_turn(self) -> ScanSettings:
        if 2.0 * self.ramp_s > self.turn_s:
            raise ValueError(
                f"ramp_s must be at most half of turn_s, {self.turn_s / 2:g}, not {self.ramp_s:g}"
            )
        if (self.insert_mm > 0.0) != (self.insert_s > 0.0):
            raise ValueError("give both of insert_mm and insert_s, or none")
        return self

    def named_targets(self) -> Iterator[tuple[Keys, str]]:
        """Yield place and name of the target that is the hole, if it is one."""
        if self.hole.target is not None:
            yield ("hole", "target"), self.hole.target

    def with_targets(self, poses: Mapping[str, Placed]) -> Self:
        """Return the section with the hole at its place, the axis against the normal of the pose."""
        if self.hole.target is None:
            return self
        place, normal = poses[self.hole.target]
        assert normal is not None
        axis = tuple(-component for component in normal)
        hole = self.hole.model_copy(update={"target": None, "position_mm": place, "axis": axis})
        return self.model_copy(update={"hole": hole})
