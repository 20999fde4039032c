"""What a ``trajectory:`` section of an excitation may say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tcrctl.config.keys import Keys
from tcrctl.config.settings import Settings, quantity
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.values import NotNegative, Positive


class PullSettings(Settings):
    """Every cable alone, in and out and out and in again, with a rest at each end: shows friction and play."""

    size_mm: Positive = quantity("mm", "how far", 5.0, le=50.0)
    move_s: Positive = quantity("s", "time of a motion", 1.0)
    rest_s: Positive = quantity("s", "rest after it", 2.0)


class ShakeSettings(Settings):
    """A wave of all drives that dies away before every rest, so that no cable sticks where it came from."""

    size_mm: NotNegative = quantity("mm", "first swing; the others are smaller and smaller", 3.0, le=20.0)
    swings: int = Field(default=8, ge=1, le=100, description="how many there are")
    swing_s: Positive = quantity("s", "time of one", 0.2)


class DrawSettings(Settings):
    """Poses that are drawn: drive lengths about a common contraction, taut and not too tight by the model."""

    contraction_mm: tuple[float, float] = quantity(
        "mm", "smallest and largest length common to all", (0.0, 50.0)
    )
    reach_mm: tuple[float, float] = quantity("mm", "smallest and largest deviation from it", (5.0, 40.0))
    floor_n: Positive = quantity("N", "least tension by the model", 3.0)
    ceiling_n: Positive = quantity("N", "largest tension by the model", 30.0)


class ExcitationSettings(TrajectorySection):
    """Drive lengths from which a robot, its cameras and its drives can be identified: pulls, then poses at rest."""

    gives_drives: ClassVar[bool] = True

    kind: Literal["excitation"]
    pulls: PullSettings = PullSettings()
    poses_mm: tuple[tuple[float, ...], ...] = quantity(
        "mm", "drive lengths of every cable per pose, as identify --design writes them; drawn if left out", ()
    )
    poses: int = Field(default=26, ge=1, le=500, description="how many are drawn if none is given")
    held_out: int = Field(default=4, ge=0, le=100, description="how many more are drawn, to judge the result")
    draw: DrawSettings = DrawSettings()
    seed: int = Field(default=0, ge=0, lt=2**63, description="seed of what is drawn")
    shake: ShakeSettings = ShakeSettings()
    move_s: Positive = quantity("s", "least time of a motion from pose to pose", 2.0)
    speed_mm_s: Positive = quantity("mm/s", "peak speed of a drive in it; long motions take longer", 35.0)
    rest_s: Positive = quantity("s", "rest in every pose", 2.5)
    lead_in_s: NotNegative = quantity("s", "rest at the start", 3.0)
    settle_s: NotNegative = quantity("s", "rest at the very end", 1.0)

    @model_validator(mode="after")
    def _as_many(self) -> ExcitationSettings:
        counts = {len(pose) for pose in self.poses_mm}
        if len(counts) > 1:
            raise ValueError(
                f"poses_mm have {min(counts)} to {max(counts)} lengths; every pose needs as many"
            )
        return self

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place and drive lengths [mm] of every pose that is given."""
        for i, pose in enumerate(self.poses_mm):
            yield ("poses_mm", i), pose
