"""What a ``controller:`` section may say, units in the key names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from tcrctl.config.settings import OrOff, Path, Settings, quantity, refuse


class CostWeights(Settings):
    """Weights of the cost (30): end pose error, drive speeds and their changes."""

    position: float = quantity("1/m2", "weight of the squared end position error", 3.0e4, gt=0)
    normal: float = quantity("1", "weight of the squared end normal error; output: pose only", 0.0, ge=0)
    twist: float = quantity(
        "1/rad2", "weight of the squared twist about the end normal; output: pose only", 0.0, ge=0
    )
    speed: float = quantity("s2/m2", "weight R of the squared drive speeds", 1.0, ge=0)
    speed_change: float = quantity("s2/m2", "weight W of the squared changes of drive speed", 3.5e3, ge=0)


class TensionSettings(Settings):
    """Keeps every cable taut: a pull towards a reference tension, and a soft floor and ceiling."""

    reference_n: float = quantity("N", "tension that every cable is drawn to", 5.0, gt=0)
    weight: float = quantity("1/N2", "weight of the squared deviation from it", 1.0e-2, ge=0)
    floor_n: float = quantity("N", "lowest tension wanted", 1.0, ge=0)
    ceiling_n: float = quantity("N", "highest tension wanted", 60.0, gt=0)
    softness: float = quantity(
        "N2", "compliance 1/rho of floor and ceiling in the LCP; smaller is harder", 1.0e-3, gt=0
    )

    @model_validator(mode="after")
    def _in_order(self) -> TensionSettings:
        refuse(self._disorder())
        return self

    def _disorder(self) -> Iterator[tuple[Path, str]]:
        if self.floor_n >= self.reference_n:
            yield ("floor_n",), f"must be below reference_n, {self.reference_n:g}, not {self.floor_n:g}"
        if self.ceiling_n <= self.reference_n:
            yield ("ceiling_n",), f"must be above reference_n, {self.reference_n:g}, not {self.ceiling_n:g}"


class IntegralSettings(Settings):
    """Integral action: the target is shifted by gain times the integrated error, with anti-windup."""

    gain_1_s: float = quantity("1/s", "integral gain", 3.0, gt=0)
    limit_mm: float = quantity("mm", "largest shift of the target position", 20.0, gt=0)
    limit_deg: float = quantity("deg", "largest tilt of the target normal; output: pose only", 10.0, gt=0)


class OffsetSettings(Settings):
    """Estimates where the robot would come to rest, as opposed to where the model would."""

    filter_s: float = quantity("s", "time constant of the estimate", 0.3, gt=0)


class IocSettings(Settings):
    """Instantaneous optimal control (30)-(41) with a prediction horizon of its own."""

    kind: Literal["ioc"]
    output: Literal["position", "pose"] = Field(default="position", description="what is tracked")
    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    horizon_s: float = quantity("s", "prediction horizon, at least one period", 0.8, gt=0, le=60)
    model: Literal["dynamic", "static"] = Field(
        default="dynamic",
        description="dynamic: the equations of motion; static: their static form, the end follows the drives "
        "at once",
    )
    prediction: Literal["multi_step", "one_step", "literal"] = Field(
        default="multi_step",
        description="multi_step: linear response over the horizon; one_step: one backward-Euler step as long "
        "as the horizon; literal: the paper's Algorithm 1, one generalized-alpha step of one period",
    )
    instants: int = Field(
        default=16,
        ge=1,
        le=60,
        description="equally spaced prediction instants in the horizon; prediction: multi_step only",
    )
    blocks: int = Field(
        default=4,
        ge=1,
        le=12,
        description="piecewise constant inputs over the horizon; prediction: multi_step only",
    )
    modes: int = Field(
        default=8, ge=1, le=60, description="modes of the prediction; prediction: multi_step only"
    )
    offset: OrOff[OffsetSettings] = Field(
        default=OffsetSettings(), description="offset of the equilibrium, or off; prediction: multi_step only"
    )
    feedforward: bool = Field(
        default=True,
        description="changes of drive speed are weighed against those that the reference needs, not against none; "
        "prediction: multi_step only",
    )
    weights: CostWeights = Field(default=CostWeights(), description="weights of the cost (30)")
    tension: OrOff[TensionSettings] = Field(
        default=TensionSettings(), description="keeps cables taut, or off"
    )
    integral: OrOff[IntegralSettings] = Field(
        default=IntegralSettings(), description="integral action, or off"
    )
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> IocSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[tuple[Path, str]]:
        if self.horizon_s < self.period_s:
            yield ("horizon_s",), f"must be at least period_s, {self.period_s:g}, not {self.horizon_s:g}"
        if self.model == "static" and self.prediction == "one_step":
            what = "one_step is a time step of the equations of motion; statics go with multi_step or literal"
            yield ("prediction",), what
        if self.prediction == "multi_step" and self.horizon_s / self.instants > 0.25:
            yield ("instants",), "must be so many that instants lie at most 0.25 s apart"
        if self.prediction == "multi_step" and self.blocks > self.instants:
            yield ("blocks",), f"must be at most instants, {self.instants}, not {self.blocks}"
        if self.output == "position":
            for key in ("normal", "twist"):
                if getattr(self.weights, key) > 0:
                    yield ("weights", key), "has no meaning with output: position; must be 0"
        elif self.weights.normal == 0:
            yield ("weights", "normal"), "must be > 0 with output: pose, or the normal is not tracked"


class SlackGuard(Settings):
    """Moves that leave the end where it is, by the model, bring the tensions towards a reference."""

    reference_n: float = quantity("N", "tension that every cable is drawn to", 5.0, gt=0)
    gain_1_s: float = quantity("1/s", "part of the difference that is removed per second", 0.5, gt=0)


class KinematicSettings(Settings):
    """Baseline for comparisons: resolved rates with the damped pseudo-inverse of the static map."""

    kind: Literal["kinematic"]
    output: Literal["position", "pose"] = Field(default="position", description="what is tracked")
    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    gain_1_s: float = quantity("1/s", "part of the measured error that is removed per second", 0.3, ge=0)
    integral: OrOff[IntegralSettings] = Field(default=None, description="integral action, or off")
    damping: float = quantity("m/m", "damping of the pseudo-inverse", 0.05, ge=0)
    lever_mm: float = quantity(
        "mm", "length that makes a change of the normal comparable with one of the position", 100.0, gt=0
    )
    tension: OrOff[SlackGuard] = Field(
        default=SlackGuard(), description="keeps cables taut where the pose leaves a choice, or off"
    )
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)


class OpenLoopSettings(Settings):
    """Moves the drives to the lengths that the trajectory gives; nothing is fed back."""

    kind: Literal["open_loop"]
    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)


ControllerSettings: TypeAlias = Annotated[
    IocSettings | KinematicSettings | OpenLoopSettings, Field(discriminator="kind")
]
"""Union of all kinds of controller, told apart by ``kind``."""
