"""What a ``trajectory:`` section of samples from a file may say."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from tcrctl.config.settings import quantity
from tcrctl.trajectory.sampled_section import SampledSection
from tcrctl.trajectory.values import Positive


class TableSettings(SampledSection):
    """Samples from a file (CSV, Parquet, npz): time, position, normal or quaternion; from rest to rest."""

    kind: Literal["table"]
    file: str = Field(
        description="path of the samples relative to this file; units in the header", min_length=1
    )
    largest_gap: Positive = quantity("1", "longest time between two samples, in medians", 5.0, gt=1.0)

    @property
    def called(self) -> str:
        """The file."""
        return self.file

    @property
    def kept_name(self) -> str:
        """``trajectory.`` and how the file ends."""
        return kept_name(self.file)

    @property
    def gap_limit(self) -> float:
        """As given."""
        return self.largest_gap


def kept_name(file: str) -> str:
    """Return the name under which a run keeps a table."""
    return f"trajectory{Path(file).suffix.lower()}"
