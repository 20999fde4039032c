"""What an ``estimator:`` section may say, units in the key names."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import Field

from tcrctl.config.settings import ShortKind, quantity
from tcrctl.estimator.calibration_settings import Calibrated, CalibrationSettings
from tcrctl.estimator.section import EstimatorSection


class PassiveObserverSettings(EstimatorSection):
    """Steps the model with the applied command, drawn to the measured rings by virtual springs."""

    kind: Literal["passive_observer"]
    stiffness_n_m: float = quantity(
        "N/m",
        "virtual spring to every marker when all are seen; falls with the square of the seen share",
        1.0e4,
        gt=0,
    )
    pose_filter_s: float = quantity(
        "s", "time constant of the end pose's correction by the measured tip ring", 0.5, gt=0
    )
    fit_start: bool = Field(
        default=True,
        description="begin with the model fitted to the first frame, at rest, instead of its own rest",
    )
    hold_blank: bool = Field(
        default=True, description="a frame without any marker repeats the last one, instead of none"
    )
    calibration: Calibrated = Field(
        default="off",
        description="where cameras and markers really are: path of a calibration file relative to this one, what "
        "it says, or off",
    )

    @property
    def calibrated(self) -> CalibrationSettings | None:
        """What is known of cameras and markers; None if nothing, or if the file is not read yet."""
        return self.calibration if isinstance(self.calibration, CalibrationSettings) else None


class ExactSettings(EstimatorSection):
    """Passes the simulated plant's true state on; for studies on a simulated plant."""

    needs_every_step: ClassVar[bool] = True

    kind: Literal["exact"]


EstimatorSettings: TypeAlias = Annotated[
    PassiveObserverSettings | ExactSettings,
    Field(discriminator="kind", description="state estimator"),
    ShortKind("passive_observer", "exact"),
]
