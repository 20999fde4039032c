"""What a ``controller:`` section may say, units in the key names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Final, Literal, TypeAlias

from pydantic import Field, model_validator

from tcrctl.config.settings import OrOff, Path, Settings, ShortKind, quantity, refuse

#: Modes of a response, if the file does not say.
MODES: Final = 8
#: Largest distance of two prediction instants [s]; the slow modes swing at about 1 Hz.
LONGEST_SPACING: Final = 0.25


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

    gain_1_s: float = quantity("1/s", "integral gain", 2.0, gt=0)
    limit_mm: float = quantity("mm", "largest shift of the target position", 20.0, gt=0)
    limit_deg: float = quantity("deg", "largest tilt of the target normal; output: pose only", 10.0, gt=0)


class OffsetSettings(Settings):
    """Estimates where the robot would come to rest, as opposed to where the model would."""

    filter_s: float = quantity("s", "time constant of the estimate", 0.3, gt=0)
    from_start: bool = Field(default=True, description="begin with the first frame's offset instead of none")


class TensionGapSettings(Settings):
    """Cable tensions are not read off positions alone: lasting differences from the model's are left out."""

    filter_s: float = quantity("s", "time constant after which a difference counts as lasting", 1.0, gt=0)


class DitherSettings(Settings):
    """Fast small motion of the drives against friction; as large as the prediction is wrong."""

    frequency_hz: float = quantity("Hz", "frequency of the triangle wave", 5.0, gt=0, le=100)
    least_mm: float = quantity("mm", "smallest amplitude, there from the start", 0.0, ge=0, le=5)
    most_mm: float = quantity("mm", "largest amplitude", 2.0, gt=0, le=5)
    threshold_mm: float = quantity("mm", "innovation of the end position that is not friction", 0.3, gt=0)
    growth_1_s: float = quantity("1/s", "growth of the amplitude by innovation beyond the threshold", 8.0, gt=0)
    release_s: float = quantity("s", "time constant of its decay", 100.0, gt=0)
    filter_s: float = quantity("s", "time constant of the innovation's size", 0.2, gt=0)
    outlier_mm: float = quantity("mm", "largest innovation that counts", 5.0, gt=0)


class MultiStepSettings(Settings):
    """Linear response over the horizon, or with ``model: static`` the static answer to the drives."""

    kind: Literal["multi_step"]
    horizon_s: float = quantity("s", "prediction horizon, at least one control period", 0.8, gt=0, le=60)
    instants: int = Field(
        default=16, ge=1, le=60, description="equally spaced prediction instants in the horizon"
    )
    blocks: int = Field(default=4, ge=1, le=12, description="piecewise constant inputs over the horizon")
    modes: int = Field(default=MODES, ge=1, le=60, description="modes of the response; model: dynamic only")
    offset: OrOff[OffsetSettings] = Field(
        default=OffsetSettings(), description="offset of the equilibrium, or off"
    )
    tension_gap: OrOff[TensionGapSettings] = Field(
        default=TensionGapSettings(), description="lasting differences of tension, left out, or off"
    )
    feedforward: bool = Field(
        default=True,
        description="changes of drive speed are weighed against those that the reference needs, not against none",
    )

    @property
    def filter_s(self) -> float | None:
        """Time constant of the offset [s]; None if it is off."""
        return None if self.offset is None else self.offset.filter_s

    def misfits(self, period_s: float, model: str) -> Iterator[tuple[Path, str]]:
        """Yield path and message of what does not go with a control period [s] and a model."""
        yield from _too_short(self.horizon_s, period_s)
        if model == "static" and self.modes != MODES:
            yield ("modes",), "has no meaning with model: static; leave it out"

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> MultiStepSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[tuple[Path, str]]:
        if self.horizon_s / self.instants > LONGEST_SPACING:
            yield ("instants",), f"must be so many that instants lie at most {LONGEST_SPACING:g} s apart"
        if self.blocks > self.instants:
            yield ("blocks",), f"must be at most instants, {self.instants}, not {self.blocks}"


class OneStepSettings(Settings):
    """One backward-Euler step as long as the horizon."""

    kind: Literal["one_step"]
    horizon_s: float = quantity("s", "prediction horizon, at least one control period", 0.8, gt=0, le=60)

    def misfits(self, period_s: float, model: str) -> Iterator[tuple[Path, str]]:
        """Yield path and message of what does not go with a control period [s] and a model."""
        yield from _too_short(self.horizon_s, period_s)
        if model == "static":
            yield (
                (),
                "one_step is a time step of the equations of motion; statics go with multi_step or literal",
            )


class LiteralSettings(Settings):
    """The paper's Algorithm 1: one generalized-alpha step of one control period, or its static form."""

    kind: Literal["literal"]

    def misfits(self, period_s: float, model: str) -> Iterator[tuple[Path, str]]:
        """Yield nothing: it has no horizon but the control period, and goes with both models."""
        del period_s, model
        yield from ()


def _too_short(horizon_s: float, period_s: float) -> Iterator[tuple[Path, str]]:
    if horizon_s < period_s:
        yield ("horizon_s",), f"must be at least period_s, {period_s:g}, not {horizon_s:g}"


Prediction: TypeAlias = Annotated[
    MultiStepSettings | OneStepSettings | LiteralSettings,
    Field(discriminator="kind"),
    ShortKind("multi_step", "one_step", "literal"),
]
"""Union of all kinds of prediction; the bare name of a kind stands for that kind with its defaults."""


class IocSettings(Settings):
    """Instantaneous optimal control (30)-(41) with a prediction horizon of its own."""

    moved: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("horizon_s", "instants", "blocks", "modes", "offset", "feedforward"), "prediction"
    )

    kind: Literal["ioc"]
    output: Literal["position", "pose"] = Field(default="position", description="what is tracked")
    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    model: Literal["dynamic", "static"] = Field(
        default="dynamic",
        description="dynamic: the equations of motion; static: their static form, the end follows the drives "
        "at once",
    )
    prediction: Prediction = Field(
        default=MultiStepSettings(kind="multi_step"),
        description="what the outputs will be: multi_step, one_step or literal",
    )
    weights: CostWeights = Field(default=CostWeights(), description="weights of the cost (30)")
    tension: OrOff[TensionSettings] = Field(
        default=TensionSettings(), description="keeps cables taut, or off"
    )
    integral: OrOff[IntegralSettings] = Field(
        default=IntegralSettings(), description="integral action, or off"
    )
    dither: OrOff[DitherSettings] = Field(
        default=DitherSettings(), description="keeps cables from sticking in their holes, or off"
    )
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> IocSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[tuple[Path, str]]:
        for path, what in self.prediction.misfits(self.period_s, self.model):
            yield ("prediction", *path), what
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
