"""What a ``trajectory:`` section of a function of time may say."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field, model_validator

from tcrctl.config.settings import quantity
from tcrctl.trajectory.sampled_section import SampledSection
from tcrctl.trajectory.values import Positive

#: Most samples of a function.
MOST_SAMPLES: Final = 200_000
FEWEST_SAMPLES: Final = 4


class FunctionSettings(SampledSection):
    """A function of time in Python, sampled once: end position (3,) [m], or that and the unit normal (6,)."""

    kind: Literal["function"]
    function: str = Field(
        description="my_module:name, or ./my_file.py:name relative to this file; takes the time in s, a float",
        pattern=r"^.+:\w+$",
    )
    duration_s: Positive = quantity("s", "until when it is sampled, from 0", le=86400.0)
    rate_hz: Positive = quantity("Hz", "samples per second", 50.0, le=10000.0)

    @model_validator(mode="after")
    def _some_samples(self) -> FunctionSettings:
        count = self.duration_s * self.rate_hz + 1.0
        if not FEWEST_SAMPLES <= count <= MOST_SAMPLES:
            raise ValueError(
                f"duration_s * rate_hz must give {FEWEST_SAMPLES} to {MOST_SAMPLES} samples, not {count:.0f}"
            )
        return self

    @property
    def called(self) -> str:
        """The function."""
        return self.function

    @property
    def kept_name(self) -> str:
        """One file for all functions."""
        return "trajectory.csv"

    @property
    def gap_limit(self) -> float:
        """Samples are evenly spaced."""
        return 2.0
