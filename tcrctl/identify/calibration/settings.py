"""What is assumed beforehand: how far a robot may be from its file, and how well it comes to rest."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tcrctl.config.settings import NotNegative, Positive, Settings, quantity


class PriorSettings(Settings):
    """Standard deviations; those of a *moderate* robot of docs/reality.md."""

    springs: Positive = quantity("1", "Young's modulus of all springs together, relative", 0.3)
    density: Positive = quantity("1", "all masses together, relative", 0.2)
    joint_springs: Positive = quantity("1", "springs of one joint from those of the others, relative", 0.1)
    masses: Positive = quantity("1", "mass of one module, relative", 0.05)
    geometry_mm: Positive = quantity("mm", "every coordinate of every node within its module", 0.5)
    holes_deg: Positive = quantity("deg", "every hole's angle on its ring", 1.0)
    tilt_deg: Positive = quantity("deg", "tilt of the base", 0.25)
    tension: Positive = quantity("1", "all initial tensions together, relative", 0.15)
    zeros_mm: Positive = quantity("mm", "zero of every drive", 1.0)
    radius: Positive = quantity("1", "winch of every drive, relative", 0.01)
    backlash_mm: Positive = quantity("mm", "play of all drives", 0.3)
    frame_deg: Positive = quantity("deg", "frame of the cameras, angle", 0.25)
    frame_mm: Positive = quantity("mm", "frame of the cameras, distance", 0.5)
    marker_mm: Positive = quantity("mm", "distance of every marker from its node", 1.0)


class RestSettings(Settings):
    """What is different each time a robot comes to rest."""

    noise_um: Positive = quantity("um", "a marker's mean place", 50.0)
    stick: NotNegative = quantity(
        "1", "tension that a hole holds back after a shake, over wrap angle and tension", 0.03
    )
    play_mm: NotNegative = quantity("mm", "cable at the drive", 0.1)
    least_s: Positive = quantity("s", "drives that stand so long are at rest", 1.5)
    window_s: Positive = quantity("s", "last part of a rest, of which the frames are averaged", 1.0)
    presliding_mm: Positive = quantity("mm", "way of a cable from one edge of its friction to the other", 2.0)
    least_wrap_deg: NotNegative = quantity("deg", "least angle by which a cable wraps a hole", 2.0)
    step_ms: float = quantity("ms", "time step of the simulation that friction is found by", 5.0, gt=0, le=50)


class SelfCalibrationSpec(Settings):
    """One self-calibration, every default filled in."""

    kind: Literal["self_calibration"] = "self_calibration"
    scale: Positive = quantity(
        "1", "factor on all priors but springs and density: 0.5 mild, 1 moderate, 2 severe", 1.0
    )
    priors: PriorSettings = PriorSettings()
    rest: RestSettings = RestSettings()
    friction: bool = Field(default=True, description="simulate the pulls to find friction; takes a minute")
    iterations: int = Field(default=12, ge=1, le=100, description="most Gauss-Newton steps")
    held_out: int | None = Field(
        default=None,
        ge=0,
        description="last poses that are kept to judge the result; default: as the excitation says, else a sixth",
    )
