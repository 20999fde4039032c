"""``plant.realistic``: a plant with everything that real robots have, drawn in one of three sizes.

*moderate* is what was seen on robots of this kind (docs/reality.md), *mild* is half of it, *severe* about twice. It
fills in the sections of the plant that are not given; what is given wins. It does not touch ``mismatch``, noise and
latency: they stay as the file says, and come on top.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from tcrctl.plant.reality_settings import (
    DRAWN,
    CableEffects,
    CameraSettings,
    CreepBranch,
    DriveSettings,
    FrameError,
    HysteresisSettings,
    ScatterSettings,
)
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.robot.sections import FrictionSettings

if TYPE_CHECKING:  # numpy is imported where something is drawn: checking a file needs none
    import numpy as np

#: Time constant of the cables' creep [s].
CREEP_TIME_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large the effects of one level are; standard deviations, unless said.

    Attributes:
        friction: Smallest and largest coefficient, drawn evenly for the whole robot.
        lag_s: Lag of the drives, fixed [s].
        dead_time_s: Their dead time, fixed [s].
        backlash_mm: Their play, fixed [mm].
        radius: Error of the winches, relative.
        zero_mm: Error of the zeros [mm].
        tension: By which part all cables are too tight or too loose: one or the other, by this.
        springs: Scatter of springs, relative.
        masses: Scatter of masses, relative.
        scatter: Scatter of geometry and holes, in the size of *moderate*.
        marker_mm: Distance of every marker from its node, fixed [mm].
        frame_deg: Angle by which the frame of the cameras is off, fixed [deg].
        frame_mm: Distance by which it is off, fixed [mm].
        lost_markers: Share of markers lost.
        lost_frames: Share of frames lost.
        jitter_ms: Jitter of the age of frames [ms].
        creep: Late elongation relative to the elastic one.
        hysteresis: Loss of the springs.
    """

    friction: tuple[float, float]
    lag_s: float
    dead_time_s: float
    backlash_mm: float
    radius: float
    zero_mm: float
    tension: float
    springs: float
    masses: float
    scatter: float
    marker_mm: float
    frame_deg: float
    frame_mm: float
    lost_markers: float
    lost_frames: float
    jitter_ms: float
    creep: float
    hysteresis: float


LEVELS: Final[Mapping[str, Sizes]] = {
    "mild": Sizes(
        friction=(0.05, 0.05), lag_s=0.015, dead_time_s=0.0, backlash_mm=0.1, radius=0.005, zero_mm=0.5,
        tension=0.075, springs=0.05, masses=0.025, scatter=0.5, marker_mm=0.5, frame_deg=0.125, frame_mm=0.25,
        lost_markers=0.025, lost_frames=0.005, jitter_ms=1.5, creep=0.05, hysteresis=0.025,
    ),
    "moderate": Sizes(
        friction=(0.1, 0.1), lag_s=0.03, dead_time_s=0.0, backlash_mm=0.2, radius=0.01, zero_mm=1.0,
        tension=0.15, springs=0.1, masses=0.05, scatter=1.0, marker_mm=1.0, frame_deg=0.25, frame_mm=0.5,
        lost_markers=0.05, lost_frames=0.01, jitter_ms=3.0, creep=0.1, hysteresis=0.05,
    ),
    "severe": Sizes(
        friction=(0.2, 0.3), lag_s=0.1, dead_time_s=0.05, backlash_mm=0.4, radius=0.02, zero_mm=2.0,
        tension=0.3, springs=0.16, masses=0.06, scatter=2.0, marker_mm=2.0, frame_deg=0.5, frame_mm=1.0,
        lost_markers=0.1, lost_frames=0.02, jitter_ms=6.0, creep=0.2, hysteresis=0.1,
    ),
}  # fmt: skip
#: Scatter of geometry and holes in *moderate*.
GEOMETRY_MM, HOLES_DEG, TILT_DEG = 0.5, 1.0, 0.25


def as_drawn(settings: SimulatedSettings, cables: int, seed: int) -> SimulatedSettings:
    """Return a plant's settings with everything that ``realistic`` draws filled in.

    Args:
        settings: Of the plant; they are returned if ``realistic`` is off.
        cables: Number of cables.
        seed: Of the run; counts if there is no ``realistic_seed``.
    """
    if settings.realistic == "off":
        return settings
    seed = seed if settings.realistic_seed is None else settings.realistic_seed
    drawn = draw(LEVELS[settings.realistic], cables, seed)
    given = settings.model_fields_set
    left: dict[str, Any] = {name: drawn[name] for name in DRAWN if name not in given}
    return settings.model_copy(update={**left, "realistic_seed": seed})


def draw(sizes: Sizes, cables: int, seed: int) -> dict[str, Any]:
    """Return all sections of one plant; what has a seed of its own gets one that follows from ``seed``."""
    import numpy as np

    random = np.random.default_rng(np.random.SeedSequence([seed, 0x7C7]))
    scatter_seed, camera_seed = (int(part) for part in random.integers(2**31, size=2))
    friction = round(float(random.uniform(*sizes.friction)), 4)
    tension = 1.0 + sizes.tension * float(random.choice([-1.0, 1.0]))
    k = sizes.scatter
    return {
        "scatter": ScatterSettings(
            springs=sizes.springs,
            masses=sizes.masses,
            geometry_mm=k * GEOMETRY_MM,
            holes_deg=k * HOLES_DEG,
            tilt_deg=k * TILT_DEG,
            seed=scatter_seed,
        ),
        "friction": FrictionSettings(coefficient=friction, least_wrap_deg=2.0),
        "drives": DriveSettings(
            lag_s=sizes.lag_s,
            dead_time_s=sizes.dead_time_s,
            backlash_mm=sizes.backlash_mm,
            radius_error=_each(random, sizes.radius, cables),
            zero_error_mm=_each(random, sizes.zero_mm, cables),
        ),
        "cables": CableEffects(
            initial_tension=tension,
            creep=(CreepBranch(strength=sizes.creep, time_s=CREEP_TIME_S),),
        ),
        "springs_hysteresis": HysteresisSettings(share=sizes.hysteresis),
        "cameras": CameraSettings(
            marker_bias_mm=sizes.marker_mm,
            frame_error=FrameError(rotation_deg=sizes.frame_deg, translation_mm=sizes.frame_mm),
            lost_markers=sizes.lost_markers,
            lost_frames=sizes.lost_frames,
            age_jitter_ms=sizes.jitter_ms,
            seed=camera_seed,
        ),
    }


def _each(random: np.random.Generator, size: float, count: int) -> tuple[float, ...]:
    """Draw one value per cable, none beyond twice the standard deviation."""
    import numpy as np

    drawn = np.clip(random.standard_normal(count), -2.0, 2.0)
    return tuple(round(float(size * x), 6) for x in drawn)
