"""The ``dither:`` section of a controller."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import Settings, quantity, refuse


class DitherSettings(Settings):
    """Fast small motion of the drives against friction; as large as it has to be."""

    frequency_hz: float = quantity("Hz", "frequency of the triangle wave", 5.0, gt=0, le=100)
    least_mm: float = quantity("mm", "smallest amplitude, there from the start", 0.0, ge=0, le=5)
    most_mm: float = quantity("mm", "largest amplitude", 2.0, gt=0, le=5)
    threshold_mm: float = quantity("mm", "innovation of the end position that is not friction", 0.2, gt=0)
    motion_part: float = quantity(
        "1", "part of the motion expected by which a model without friction is wrong, too", 0.5, ge=0, le=1
    )
    growth_1_s: float = quantity(
        "1/s", "growth of the amplitude by innovation beyond the threshold", 30.0, gt=0
    )
    speed_part: float = quantity("1", "part of the speed limit that the wave may take", 0.6, gt=0, le=0.8)
    release_s: float = quantity("s", "time constant of its decay", 100.0, gt=0)
    filter_s: float = quantity("s", "time constant of the innovation's size", 0.1, gt=0)
    outlier_mm: float = quantity("mm", "largest innovation that counts", 5.0, gt=0)
    probe_mm: float = quantity(
        "mm",
        "amplitude of the sideways wave that tries while the controller settles whether cables rub; 0: none",
        0.2,
        ge=0,
        le=5,
    )
    rubs_mm: float = quantity(
        "mm",
        "way by which that wave throws the end, beyond what it does without friction, if they do",
        0.03,
        gt=0,
    )
    speed_change: float = quantity(
        "s2/m2",
        "weight of squared changes of drive speed while it runs, if that is the larger one",
        3.5e3,
        gt=0,
    )
    integral_gain_1_s: float = quantity(
        "1/s", "integral gain while it runs, if that is the smaller one", 0.7, gt=0
    )

    @model_validator(mode="after")
    def _in_order(self) -> DitherSettings:
        refuse(self._disorder())
        return self

    def _disorder(self) -> Iterator[Finding]:
        if self.least_mm > self.most_mm:
            yield ("least_mm",), f"must be at most most_mm, {self.most_mm:g}, not {self.least_mm:g}"
