"""What all ``trajectory:`` sections of samples may say, wherever the samples come from."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, PrivateAttr

from tcrctl.config.settings import quantity
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.values import NotNegative, Positive


class SampledSection(TrajectorySection):
    """An end pose over time given by samples, which are kept as a file with the run."""

    kind: str
    origin: Literal["world", "rest"] = Field(
        default="world",
        description="where positions start: the world frame's origin, or the rest end position",
    )
    speed_limit_mm_s: Positive = quantity("mm/s", "samples that need more are refused", 200.0)
    acceleration_limit_mm_s2: Positive = quantity("mm/s2", "samples that need more are refused", 2000.0)
    lead_in_s: NotNegative = quantity("s", "rest at the first sample", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the last sample", 2.0)

    _content: bytes = PrivateAttr(default=b"")

    @property
    def called(self) -> str:
        """What the samples are called in messages."""
        raise NotImplementedError

    @property
    def kept_name(self) -> str:
        """Name of the file under which a run keeps the samples."""
        raise NotImplementedError

    @property
    def gap_limit(self) -> float:
        """Longest time between two samples, in medians."""
        raise NotImplementedError

    @property
    def content(self) -> bytes:
        """The samples as a file; empty until they are read."""
        return self._content

    def with_content(self, content: bytes) -> Self:
        """Return the same with its samples, which are not written with the settings."""
        copy = self.model_copy()
        copy._content = content
        return copy
