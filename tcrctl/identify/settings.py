"""The identification file: which robot, which data, which of the robot's numbers are to be found, and how."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import Settings, Vector, quantity, refuse
from tcrctl.robot.sections import Name

Method = Literal["pso+least-squares", "pso", "least-squares"]


class ParameterSettings(Settings):
    """One parameter: its bounds, in the unit of the robot file."""

    low: float | None = Field(default=None, description="lower bound; half the robot's value if left out")
    high: float | None = Field(default=None, description="upper bound; twice the robot's value if left out")
    scale: Literal["log", "linear"] | None = Field(
        default=None, description="how the range is walked through; log if the bounds are positive"
    )

    @model_validator(mode="after")
    def _in_order(self) -> ParameterSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[Finding]:
        if self.low is not None and self.high is not None and self.low >= self.high:
            yield ("high",), f"must be above low, {self.low:g}, not {self.high:g}"
        if self.scale == "log" and self.low is not None and self.low <= 0.0:
            yield ("low",), f"must be > 0 with scale: log, not {self.low:g}"


class DataSettings(Settings):
    """One file of data: static sets (.yaml, .csv) or a logged run (.mcap)."""

    file: str = Field(description="path relative to this file", min_length=1)
    start_s: float = quantity("s", "logs: what is before is simulated, but not compared", 0.0, ge=0)
    stop_s: float | None = quantity("s", "logs: what is after is left out; default: the end", None, gt=0)
    frames: int = Field(default=200, ge=2, description="logs: most camera frames that are compared")

    @model_validator(mode="after")
    def _in_order(self) -> DataSettings:
        if self.stop_s is not None and self.stop_s <= self.start_s:
            refuse([(("stop_s",), f"must be after start_s, {self.start_s:g}, not {self.stop_s:g}")])
        return self


class FrameSettings(Settings):
    """How the frame of the measurement lies in the robot's frame: measured = Rz(yaw) mirror model + offset."""

    offset: Literal["known", "fit", "displacement"] = Field(
        default="known",
        description="fit: three more unknowns; displacement: compare displacements from one configuration",
    )
    offset_mm: Vector = quantity("mm", "origin of the robot in the frame, if known", (0.0, 0.0, 0.0))
    reference: str = Field(default="", description="configuration that displacements are taken from")
    yaw: Literal["known", "fit"] = Field(default="known", description="fit: one more unknown")
    yaw_deg: float = quantity("deg", "direction of the robot's x axis in the frame, if known", 0.0)
    mirrored: Literal["no", "yes", "try"] = Field(
        default="no", description="the frame is left-handed, or the cables are numbered the other way round"
    )

    @model_validator(mode="after")
    def _agrees(self) -> FrameSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[Finding]:
        if self.offset == "displacement" and not self.reference:
            yield ("reference",), "required with offset: displacement"
        if self.offset != "displacement" and self.reference:
            yield ("reference",), f"has no meaning with offset: {self.offset}"
        if self.offset != "known" and self.offset_mm != (0.0, 0.0, 0.0):
            yield ("offset_mm",), f"has no meaning with offset: {self.offset}"
        if self.yaw == "fit" and self.yaw_deg != 0.0:
            yield ("yaw_deg",), "has no meaning with yaw: fit"


class SwarmSettings(Settings):
    """Particle swarm."""

    particles: int = Field(default=20, ge=2, le=10000, description="number of particles")
    iterations: int = Field(default=40, ge=1, description="most iterations")
    patience: int = Field(
        default=8, ge=1, description="ends after so many iterations without an improvement of 0.1 %"
    )


class IdentificationSpec(Settings):
    """One identification, every default filled in."""

    kind: Literal["identification"]
    name: Name
    description: str = Field(default="", description="one line for listings")
    source: str = Field(default="", description="where the data come from")
    robot: str = Field(
        description="shipped robot, or path of a robot file relative to this one", min_length=1
    )
    parameters: Annotated[dict[str, ParameterSettings], Field(min_length=1)] = Field(
        description="what is to be found: dotted path in the robot file -> bounds"
    )
    data: tuple[DataSettings, ...] = Field(description="measured data", min_length=1)
    frame: FrameSettings = FrameSettings()
    strung_by: Literal["tension", "length"] | None = Field(
        default=None,
        description="what stays when parameters change: initial tensions as in the robot file, or rest lengths; "
        "default: length if all data are logs of simulated plants, which keep theirs, else tension",
    )
    method: Method = Field(default="pso+least-squares", description="how the parameters are found")
    pso: SwarmSettings = SwarmSettings()
    seed: int = Field(default=0, ge=0, lt=2**32, description="seed of the swarm")
    step_ms: float = quantity("ms", "internal time step of simulated logs", 5.0, gt=0, le=50)
    noise_mm: float = quantity("mm", "least standard deviation assumed of a coordinate", 0.05, gt=0)
    tolerance_percent: float = quantity(
        "%", "a combination of parameters less certain than this counts as not identifiable", 10.0, gt=0
    )
