"""What a ``trajectory:`` section of samples may say."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, PrivateAttr

from tcrctl.config.settings import quantity
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.values import NotNegative, Positive


class TableSettings(TrajectorySection):
    """Samples from a file (CSV, Parquet, npz): time, position, normal or quaternion; from rest to rest."""

    kind: Literal["table"]
    file: str = Field(
        description="path of the samples relative to this file; units in the header", min_length=1
    )
    origin: Literal["world", "rest"] = Field(
        default="world",
        description="where positions start: the world frame's origin, or the rest end position",
    )
    speed_limit_mm_s: Positive = quantity("mm/s", "samples that need more are refused", 200.0)
    acceleration_limit_mm_s2: Positive = quantity("mm/s2", "samples that need more are refused", 2000.0)
    largest_gap: Positive = quantity("1", "longest time between two samples, in medians", 5.0, gt=1.0)
    lead_in_s: NotNegative = quantity("s", "rest at the first sample", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the last sample", 2.0)

    _content: bytes = PrivateAttr(default=b"")

    @property
    def content(self) -> bytes:
        """The file's bytes; empty until it is read."""
        return self._content

    def with_content(self, content: bytes) -> Self:
        """Return the same with the bytes of its file, which are not written with the settings."""
        copy = self.model_copy()
        copy._content = content
        return copy
