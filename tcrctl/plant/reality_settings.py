"""What the simulated plant may have of a real robot: one section per effect, all off by default."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from tcrctl.config.settings import NotNegative, Positive, Settings, quantity
from tcrctl.robot.sections import CablesOrOne

Level: TypeAlias = Literal["off", "mild", "moderate", "severe"]
Share: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]
Seed: TypeAlias = Annotated[int, Field(ge=0, lt=2**63)]


def _own_robot_tag(value: Any) -> str:
    return "(differences)" if isinstance(value, dict) else "(name)"


OwnRobot: TypeAlias = Annotated[
    Annotated[str, Field(min_length=1), Tag("(name)")] | Annotated[dict[str, Any], Tag("(differences)")],
    Discriminator(_own_robot_tag),
]


class ScatterSettings(Settings):
    """How unlike the modules, springs and holes of the plant are; everything is drawn once, by the seed."""

    springs: Share = quantity(
        "1", "standard deviation of the springs' Young's modulus from joint to joint, relative", 0.0
    )
    single_springs: Share = quantity("1", "that of one spring from the others of its joint", 0.0)
    masses: Share = quantity("1", "standard deviation of every module's mass, relative", 0.0)
    geometry_mm: NotNegative = quantity(
        "mm", "standard deviation of every coordinate of every node within its module", 0.0
    )
    holes_deg: NotNegative = quantity("deg", "standard deviation of every hole's angle on its ring", 0.0)
    tilt_deg: float = quantity("deg", "tilt of the base, in a direction that is drawn", 0.0, ge=0, le=45)
    seed: Seed | None = Field(default=None, description="seed of this draw; that of the run if left out")


class DriveSettings(Settings):
    """What lies between the set-point of a drive and the cable that it takes in."""

    lag_s: NotNegative = quantity("s", "time constant of the position loop", 0.0)
    dead_time_s: float = quantity("s", "time by which set-points arrive late", 0.0, ge=0, le=2)
    acceleration_limit_mm_s2: Positive | None = quantity(
        "mm/s2", "largest acceleration of a drive; no limit if left out", None
    )
    backlash_mm: NotNegative = quantity("mm", "play between drive and cable", 0.0)
    radius_error: CablesOrOne[Annotated[float, Field(gt=-0.5, lt=0.5)]] = quantity(
        "1", "by which part the winch takes in more than the drive believes, common or per cable", 0.0
    )
    zero_error_mm: CablesOrOne[float] = quantity(
        "mm", "cable taken in at the start, where the drives report zero, common or per cable", 0.0
    )
    quantisation_mm: NotNegative = quantity("mm", "one count of the encoder", 0.0)
    reports: Literal["set_point", "encoder"] = Field(
        default="encoder",
        description="what the drives report: where they shall be, or where their motors are",
    )


class CreepBranch(Settings):
    """One branch of a standard linear solid: a spring and a damper in parallel, in series with the cable."""

    strength: NotNegative = quantity("1", "elongation that comes late, relative to the elastic one")
    time_s: Positive = quantity("s", "time constant with which it comes")


class CableEffects(Settings):
    """How the plant's cables differ from those of its robot."""

    initial_tension: CablesOrOne[Annotated[float, Field(gt=0.0, le=5.0)]] = quantity(
        "1", "factor on the tension at the start, common or per cable; rest lengths follow", 1.0
    )
    creep: tuple[CreepBranch, ...] = Field(default=(), strict=False, description="elongation that comes late")


class HysteresisSettings(Settings):
    """A friction element parallel to every spring: elastic in small motions, sliding in large ones."""

    share: Share = quantity("1", "width of the force loop, as a part of the force range of the spring", 0.05)
    range_mm: Positive = quantity("mm", "change of length of a spring in which that loop is passed", 1.0)


class FrameError(Settings):
    """By how much the frame of the cameras is off; axis and direction are drawn."""

    rotation_deg: float = quantity("deg", "angle, about the centre of the base ring", 0.0, ge=0, le=45)
    translation_mm: NotNegative = quantity("mm", "distance", 0.0)


class OutlierSettings(Settings):
    """Markers that are reported somewhere else for one frame."""

    share: Share = quantity("1", "part of all markers", 0.0)
    size_mm: NotNegative = quantity("mm", "how far away, in a direction that is drawn", 20.0)


class CameraSettings(Settings):
    """What cameras do beside noise and latency."""

    marker_bias_mm: NotNegative = quantity(
        "mm", "distance of every marker from its node, in a direction that is drawn once", 0.0
    )
    frame_error: FrameError = FrameError()
    lost_markers: Share = quantity("1", "part of all markers that a frame does not have", 0.0)
    lost_frames: Share = quantity("1", "part of all frames that do not come: the last one is read again", 0.0)
    outliers: OutlierSettings = OutlierSettings()
    age_jitter_ms: float = quantity(
        "ms", "standard deviation of a frame's age, one-sided: frames only come later", 0.0, ge=0, le=1000
    )
    rate_hz: float | None = quantity(
        "Hz", "frames per second; if left out, a frame is taken for every reading", None, gt=0, le=2000
    )
    seed: Seed | None = Field(default=None, description="seed of all this; that of the run if left out")


#: Sections that ``realistic`` draws.
DRAWN: Final = ("scatter", "friction", "drives", "cables", "springs_hysteresis", "cameras")
