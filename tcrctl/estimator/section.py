"""What every ``estimator:`` section can be asked, whatever its kind."""

from __future__ import annotations

from typing import ClassVar

from tcrctl.config.settings import Settings
from tcrctl.estimator.calibration_settings import CalibrationSettings


class EstimatorSection(Settings):
    """Base of all kinds."""

    #: Whether the plant's state is its input, so that a log from which it shall be replayed has it in every step.
    needs_every_step: ClassVar[bool] = False

    @property
    def calibrated(self) -> CalibrationSettings | None:
        """What is known of cameras and markers; None if nothing, or if the file is not read yet."""
        return None
