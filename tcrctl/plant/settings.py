"""What a ``plant:`` section may say, units in the key names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import NotNegative, OrOff, Positive, Settings, Vector, quantity
from tcrctl.plant.reality_settings import (
    CableEffects,
    CameraSettings,
    DriveSettings,
    HysteresisSettings,
    Level,
    OwnRobot,
    ScatterSettings,
    Seed,
)
from tcrctl.plant.time_step import FIXED_MS, Step
from tcrctl.robot.sections import FrictionSettings


class Mismatch(Settings):
    """Factors by which the plant differs from the model that the controller knows."""

    springs_youngs_modulus: float = quantity("1", "factor on the springs' Young's modulus", 1.0, gt=0)
    cables_youngs_modulus: float = quantity("1", "factor on the cables' Young's modulus", 1.0, gt=0)
    density: float = quantity("1", "factor on all masses", 1.0, gt=0)


def _different(rings: tuple[int, ...]) -> tuple[int, ...]:
    repeated = [ring for ring, times in Counter(rings).items() if times > 1]
    if repeated:
        raise ValueError(f"ring {repeated[0]} is listed more than once")
    return rings


def _must_be_all(value: Any) -> Any:
    if value != "all":
        raise PydanticCustomError("rings", "must be all or a list of ring numbers")
    return value


def _rings_tag(value: Any) -> str:
    return "(list)" if isinstance(value, list | tuple) else "(all)"


Ring: TypeAlias = Annotated[int, Field(ge=1)]
RingList: TypeAlias = Annotated[tuple[Ring, ...], Field(min_length=1), AfterValidator(_different)]
Rings: TypeAlias = Annotated[
    Annotated[Literal["all"], BeforeValidator(_must_be_all), Tag("(all)")]
    | Annotated[RingList, Tag("(list)")],
    Discriminator(_rings_tag),
]


class PushSettings(Settings):
    """A force on a ring for a while, spread evenly over its nodes; it begins and ends between control steps."""

    ring: Ring = Field(description="ring that is pushed")
    force_n: Vector = quantity("N", "force, world frame")
    start_s: NotNegative = quantity("s", "time at which it begins")
    duration_s: Positive = quantity("s", "how long it lasts")


class DropoutSettings(Settings):
    """Rings whose markers are not seen for a while."""

    rings: RingList = Field(description="rings that are not seen")
    start_s: NotNegative = quantity("s", "time at which it begins")
    duration_s: Positive = quantity("s", "how long it lasts")


class PlantSection(Settings):
    """What every ``plant:`` section can be asked, whatever its kind."""

    @property
    def rig_file(self) -> str | None:
        """Rig that it names, or path of its file; None if there is no bench."""
        return None

    def rings_named(self) -> Iterator[tuple[Keys, int]]:
        """Yield place in the section and number of every ring that it names."""
        yield from ()

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place in the section and drive lengths [mm] wherever it gives some."""
        yield from ()

    def misfits(self, period_s: float) -> Iterator[Finding]:
        """Yield what does not go with a control period [s]."""
        del period_s
        yield from ()

    def list_misfits(self, cables: tuple[str, ...], robot: str) -> Iterator[Finding]:
        """Yield place in the section and message of every list that does not go with the cables of a robot.

        Args:
            cables: Names of the robot's cables.
            robot: Its name.
        """
        del cables, robot
        yield from ()


class SimulatedSettings(PlantSection):
    """The robot's equations of motion, integrated by the generalized-alpha method."""

    kind: Literal["simulated"]
    step_ms: Step = quantity(
        "ms",
        "internal time step, a whole number of them makes a control period; auto: as long as step_error_um lets it "
        "be, for a plant without friction and other effects of real ones, 1 for others",
        FIXED_MS,
    )
    step_error_um: float = quantity("um", "largest error of an internal step if step_ms is auto", 0.1, gt=0)
    spectral_radius: float = quantity(
        "1", "spectral radius of the integrator at infinite frequency", 0.8, ge=0, le=1
    )
    mismatch: OrOff[Mismatch] = Field(default=None, description="factors on the plant's parameters, or off")
    noise_um: float = quantity("um", "standard deviation of every measured coordinate", 0.0, ge=0)
    latency_ms: float = quantity("ms", "age of a measurement when it is read", 0.0, ge=0, le=1000)
    measured_rings: Rings = Field(default="all", description="rings whose three nodes carry markers")
    tip_load_g: float = quantity("g", "mass that the tip ring carries and the model does not know", 0.0, ge=0)
    start_drives_mm: tuple[float, ...] | None = quantity(
        "mm", "drive lengths at which the robot rests before the run, one per cable; zeros if left out", None
    )
    pushes: tuple[PushSettings, ...] = Field(default=(), description="forces from outside")
    dropouts: tuple[DropoutSettings, ...] = Field(default=(), description="markers that are not seen")
    realistic: Level = Field(
        default="off",
        description="draws all sections below that are not given, for a robot of this kind, by realistic_seed",
    )
    realistic_seed: Seed | None = Field(default=None, description="seed of it; that of the run if left out")
    robot: OwnRobot | None = Field(
        default=None,
        description="robot of the plant, if it is not the one that the controller knows: name or path of a "
        "robot file, or a map of what is different",
    )
    scatter: OrOff[ScatterSettings] = Field(default=None, description="unlike parts, or off")
    friction: OrOff[FrictionSettings] = Field(
        default=None, description="friction in the cable holes; off: what the robot's file says"
    )
    drives: OrOff[DriveSettings] = Field(default=None, description="imperfect drives, or off")
    cables: OrOff[CableEffects] = Field(default=None, description="imperfect cables, or off")
    springs_hysteresis: OrOff[HysteresisSettings] = Field(default=None, description="loss of springs, or off")
    cameras: OrOff[CameraSettings] = Field(default=None, description="imperfect cameras, or off")

    def rings_named(self) -> Iterator[tuple[Keys, int]]:
        """Yield place and number of every ring that is measured, pushed or hidden by name."""
        if self.measured_rings != "all":
            for i, ring in enumerate(self.measured_rings):
                yield ("measured_rings", i), ring
        for i, push in enumerate(self.pushes):
            yield ("pushes", i, "ring"), push.ring
        for i, dropout in enumerate(self.dropouts):
            for j, ring in enumerate(dropout.rings):
                yield ("dropouts", i, "rings", j), ring

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield the drive lengths before the run if they are given."""
        if self.start_drives_mm is not None:
            yield ("start_drives_mm",), self.start_drives_mm

    def misfits(self, period_s: float) -> Iterator[Finding]:
        """Yield that no whole number of steps makes a control period [s]."""
        if self.step_ms == "auto":
            return
        steps = period_s * 1e3 / self.step_ms
        if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
            what = f"{period_s:g} s must be a whole number of steps; with {self.step_ms:g} ms it is {steps:g}"
            yield ("step_ms",), f"a control period of {what}"

    def list_misfits(self, cables: tuple[str, ...], robot: str) -> Iterator[Finding]:
        """Yield place and message of every list that has not one entry per cable."""
        lists: list[tuple[Keys, Any]] = []
        if self.friction is not None:
            lists.append((("friction", "coefficient"), self.friction.coefficient))
        if self.drives is not None:
            lists.append((("drives", "radius_error"), self.drives.radius_error))
            lists.append((("drives", "zero_error_mm"), self.drives.zero_error_mm))
        if self.cables is not None:
            lists.append((("cables", "initial_tension"), self.cables.initial_tension))
        for keys, value in lists:
            if isinstance(value, tuple) and len(value) != len(cables):
                has = f"{robot} has {len(cables)} cables, {', '.join(cables)}"
                yield keys, f"{has}; there are {len(value)} values"


class RigSettings(PlantSection):
    """The real robot, measured by cameras and moved by drives; always paced by the clock."""

    kind: Literal["rig"]
    rig: str = Field(description="shipped rig, or path of a rig file relative to this one", min_length=1)

    @property
    def rig_file(self) -> str:
        """The rig, as it is written."""
        return self.rig


PlantSettings: TypeAlias = Annotated[
    SimulatedSettings | RigSettings, Field(discriminator="kind", description="what is controlled")
]
"""Union of all kinds of plant, told apart by ``kind``."""
