"""What a ``trajectory:`` section of given drive lengths may say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from tcrctl.config.keys import Keys
from tcrctl.config.settings import Settings, quantity
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.values import NotNegative, Positive, not_empty


class DriveLegSettings(Settings):
    """All drives from where they are to new lengths, in proportion."""

    drives_mm: Annotated[tuple[float, ...], AfterValidator(not_empty)] = quantity(
        "mm", "drive length of every cable at the end of the leg, in the order of the robot's cables"
    )
    duration_s: Positive = quantity("s", "duration of the leg")
    dwell_s: NotNegative = quantity("s", "rest at its end", 0.0)
    motion: Literal["smooth", "constant_speed"] = Field(
        default="smooth", description="smooth: from rest to rest; constant_speed: starts and stops at once"
    )


class DrivesSettings(TrajectorySection):
    """Given drive lengths over time; the wanted end pose is that of the model at rest with these drives."""

    gives_drives: ClassVar[bool] = True

    kind: Literal["drives"]
    legs: Annotated[tuple[DriveLegSettings, ...], AfterValidator(not_empty)] = Field(
        description="legs in order, at least one; the first one starts at zero drive"
    )
    lead_in_s: NotNegative = quantity("s", "rest before the first leg", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the very end, after the last dwell", 3.0)

    @model_validator(mode="after")
    def _as_many(self) -> DrivesSettings:
        counts = [len(leg.drives_mm) for leg in self.legs]
        for i, count in enumerate(counts[1:], start=2):
            if count != counts[0]:
                raise ValueError(f"leg {i} has {count} drives, but leg 1 has {counts[0]}")
        return self

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place and drive lengths [mm] of every leg."""
        for i, leg in enumerate(self.legs):
            yield ("legs", i, "drives_mm"), leg.drives_mm
