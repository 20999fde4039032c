"""What a calibration file says of one robot before its cameras: written by ``tcrctl identify --calibrate``."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from tcrctl.config.settings import NotNegative, Settings, Vector, quantity

ZERO: Vector = (0.0, 0.0, 0.0)
#: Behind a discriminator that is a function, a list of a file is no tuple any more, unless it is said.
Listed: TypeAlias = Annotated[Vector, Field(strict=False)]


class CameraFrameSettings(Settings):
    """How the frame in which the cameras report lies in that of the base: reported = R true + t."""

    rotation_deg: Listed = quantity("deg", "rotation vector of R, about the centre of the base", ZERO)
    translation_mm: Listed = quantity("mm", "t", ZERO)


class DriveCalibration(Settings):
    """What was found of the drives; a value left out could not be told."""

    lag_s: NotNegative | None = quantity("s", "time constant of their position loops", None)
    dead_time_s: NotNegative | None = quantity("s", "time by which set-points arrive late", None)
    backlash_mm: NotNegative | None = quantity("mm", "play between drive and cable", None)
    radius_error: tuple[float, ...] = quantity(
        "1", "by which part every winch takes in more than its drive believes", (), strict=False
    )


class CalibrationSettings(Settings):
    """Where cameras and markers really are, and how the drives are."""

    kind: Literal["calibration"] = "calibration"
    source: str = Field(default="", description="where the values come from")
    frame: CameraFrameSettings = CameraFrameSettings()
    markers_mm: dict[str, Listed] = quantity(
        "mm",
        "every marker beside its ring node (m1.n1), in the axes of its ring: x from n1 to n2, z the normal",
        {},
    )
    drives: DriveCalibration = DriveCalibration()


def _calibrated_tag(value: Any) -> str:
    return "(values)" if isinstance(value, dict | CalibrationSettings) else "(path)"


Calibrated: TypeAlias = Annotated[
    Annotated[str, Field(min_length=1), Tag("(path)")] | Annotated[CalibrationSettings, Tag("(values)")],
    Discriminator(_calibrated_tag),
]
