"""What a ``controller:`` section may say, units in the key names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import OrOff, Settings, quantity, refuse
from tcrctl.controller.dither_settings import DitherSettings
from tcrctl.controller.prediction_settings import MultiStepSettings, Prediction


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

    def _disorder(self) -> Iterator[Finding]:
        if self.floor_n >= self.reference_n:
            yield ("floor_n",), f"must be below reference_n, {self.reference_n:g}, not {self.floor_n:g}"
        if self.ceiling_n <= self.reference_n:
            yield ("ceiling_n",), f"must be above reference_n, {self.reference_n:g}, not {self.ceiling_n:g}"


class IntegralSettings(Settings):
    """Integral action: the target is shifted by gain times the integrated error, with anti-windup."""

    gain_1_s: float = quantity("1/s", "integral gain", 3.0, gt=0)
    limit_mm: float = quantity("mm", "largest shift of the target position", 20.0, gt=0)
    limit_deg: float = quantity("deg", "largest tilt of the target normal; output: pose only", 10.0, gt=0)


class KnownDrives(Settings):
    """What the controller believes of the drives."""

    lag_s: Annotated[float, Field(ge=0, le=2)] | Literal["auto"] = Field(
        default="auto",
        description="time constant of their position loop [s]; auto: found from what encoders report",
    )
    dead_time_s: float = quantity("s", "time by which set-points arrive late", 0.0, ge=0, le=2)
    reports: Literal["set_point", "encoder"] = Field(
        default="encoder", description="what they report: where they shall be, or where they are"
    )

    @property
    def lag(self) -> float | None:
        """Time constant [s]; None if it has to be found."""
        return None if self.lag_s == "auto" else self.lag_s


class ControllerSection(Settings):
    """What every ``controller:`` section can be asked, whatever its kind."""

    #: Whether it moves the drives to lengths that the trajectory gives.
    follows_drives: ClassVar[bool] = False

    @property
    def tracks(self) -> Literal["position", "pose"] | None:
        """What of the end is fed back; None if nothing is."""
        return None

    @property
    def shaking(self) -> DitherSettings | None:
        """Dither; None if there is none."""
        return None

    @property
    def known_drives(self) -> KnownDrives:
        """What is known of the drives."""
        return KnownDrives()

    @property
    def settling(self) -> float:
        """Time at the start in which only the dither moves the drives [s]."""
        return 0.0

    def at_once(self) -> Self:
        """Return the same without that time."""
        return self.model_copy(update={"settle_s": 0.0}) if self.settling else self

    @property
    def floor_n(self) -> float | None:
        """Lowest tension wanted [N]; None if none is."""
        return None

    @property
    def ceiling_n(self) -> float | None:
        """Highest tension wanted [N]; None if none is."""
        return None


class IocSettings(ControllerSection):
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
    drives: KnownDrives = Field(default=KnownDrives(), description="what is known of the drives")
    settle_s: float = quantity(
        "s",
        "time at the start in which only the dither moves the drives: estimator and dither find out what the "
        "robot is like",
        1.0,
        ge=0,
    )
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> IocSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[Finding]:
        for path, what in self.prediction.misfits(self.period_s, self.model):
            yield ("prediction", *path), what
        if self.output == "position":
            for key in ("normal", "twist"):
                if getattr(self.weights, key) > 0:
                    yield ("weights", key), "has no meaning with output: position; must be 0"
        elif self.weights.normal == 0:
            yield ("weights", "normal"), "must be > 0 with output: pose, or the normal is not tracked"

    @property
    def shaking(self) -> DitherSettings | None:
        """Dither; None if there is none."""
        return self.dither

    @property
    def known_drives(self) -> KnownDrives:
        """What is known of the drives."""
        return self.drives

    @property
    def tracks(self) -> Literal["position", "pose"]:
        """What of the end is fed back."""
        return self.output

    @property
    def settling(self) -> float:
        """Time at the start in which only the dither moves the drives [s]."""
        return self.settle_s

    @property
    def floor_n(self) -> float | None:
        """Lowest tension wanted [N]."""
        return None if self.tension is None else self.tension.floor_n

    @property
    def ceiling_n(self) -> float | None:
        """Highest tension wanted [N]."""
        return None if self.tension is None else self.tension.ceiling_n


class SlackGuard(Settings):
    """Moves that leave the end where it is, by the model, bring the tensions towards a reference."""

    reference_n: float = quantity("N", "tension that every cable is drawn to", 5.0, gt=0)
    gain_1_s: float = quantity("1/s", "part of the difference that is removed per second", 0.5, gt=0)


class KinematicSettings(ControllerSection):
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

    @property
    def tracks(self) -> Literal["position", "pose"]:
        """What of the end is fed back."""
        return self.output


class OpenLoopSettings(ControllerSection):
    """Moves the drives to the lengths that the trajectory gives; nothing is fed back."""

    follows_drives: ClassVar[bool] = True

    kind: Literal["open_loop"]
    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)


class OwnControllerSection(ControllerSection):
    """Base of the settings of controllers from elsewhere."""

    #: What of the end is fed back, if the class does not leave that to its settings.
    feeds_back: ClassVar[Literal["position", "pose"] | None] = "position"

    period_s: float = quantity("s", "control period", 0.05, gt=0, le=10)
    speed_limit_mm_s: float = quantity("mm/s", "hard limit of every drive speed", 50.0, gt=0)

    @property
    def tracks(self) -> Literal["position", "pose"] | None:
        """What of the end is fed back; pose needs a trajectory with an orientation."""
        return self.feeds_back


ControllerSettings: TypeAlias = Annotated[
    IocSettings | KinematicSettings | OpenLoopSettings, Field(discriminator="kind")
]
"""Union of all kinds of controller, told apart by ``kind``."""


def shaken_speed_change(settings: IocSettings) -> float:
    """Return the weight W while a dither runs [s2/m2]."""
    calm = settings.weights.speed_change
    return calm if settings.dither is None else max(calm, settings.dither.speed_change)


def shaken_integral(settings: IocSettings | KinematicSettings) -> float:
    """Return which part of the integral gain is left while a dither runs."""
    if settings.shaking is None or settings.integral is None:
        return 1.0
    return min(1.0, settings.shaking.integral_gain_1_s / settings.integral.gain_1_s)


def speed_limit(settings: ControllerSettings | OwnControllerSection) -> float:
    """Return the hard limit of every drive speed [m/s]."""
    return settings.speed_limit_mm_s / 1000.0
