"""What ``prediction:`` in a ``controller:`` section may say, units in the key names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import OrOff, Settings, ShortKind, quantity, refuse

#: Modes of a response, if the file does not say.
MODES: Final = 8
#: Largest distance of two prediction instants [s]; the slow modes swing at about 1 Hz.
LONGEST_SPACING: Final = 0.25


class OffsetSettings(Settings):
    """Estimates where the robot would come to rest, as opposed to where the model would."""

    filter_s: float = quantity("s", "time constant of the estimate", 0.3, gt=0)
    from_start: bool = Field(
        default=True,
        description="begin with the first frame's offset instead of none; model: dynamic only",
    )


class TensionGapSettings(Settings):
    """Cable tensions are not read off positions alone: lasting differences from the model's are left out."""

    filter_s: float = quantity("s", "time constant after which a difference counts as lasting", 1.0, gt=0)
    smooth_s: float = quantity(
        "s", "time constant up to which one counts as noise of the cameras and is left out, too", 0.2, ge=0
    )

    @model_validator(mode="after")
    def _in_order(self) -> TensionGapSettings:
        limit = f"must be below filter_s, {self.filter_s:g}, not {self.smooth_s:g}"
        refuse([(("smooth_s",), limit)] if self.smooth_s >= self.filter_s else [])
        return self


class HoleDragSettings(Settings):
    """Cables that a dither keeps sliding feel a drag; friction as in the robot file, else as usual."""

    turn_s: float = quantity("s", "time that the friction needs for a turn of the dither", 0.1, gt=0)
    follow_s: float = quantity("s", "time constant with which the drag follows the motion", 0.03, ge=0)


class RestGainSettings(Settings):
    """Learns how the offset goes with the drives: robots move further, or less far, than their models."""

    noise_mm: float = quantity("mm", "error of the place that the robot vibrates about", 8.0, gt=0)
    doubt: float = quantity("m/m", "by how much a drive may move the end further, usually", 1.0, gt=0)
    most: float = quantity(
        "m/m", "by how much a drive is believed to move the end further, at most", 3.0, gt=0
    )
    forget_s: float = quantity("s", "time constant after which it is forgotten", 300.0, gt=0)


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
        default=TensionGapSettings(),
        description="lasting differences of tension, left out, or off; model: dynamic only",
    )
    hole_drag: OrOff[HoleDragSettings] = Field(
        default=HoleDragSettings(),
        description="what is left of the friction of dithered cables, or off; model: dynamic only",
    )
    rest_gain: OrOff[RestGainSettings] = Field(
        default=None, description="how the offset goes with the drives, learnt, or off; model: dynamic only"
    )
    feedforward: bool = Field(
        default=True,
        description="changes of drive speed are weighed against those that the reference needs, not against none",
    )

    @property
    def filter_s(self) -> float | None:
        """Time constant of the offset [s]; None if it is off."""
        return None if self.offset is None else self.offset.filter_s

    @property
    def turn_s(self) -> float:
        """Time of a turn [s]; 0 if drag is off."""
        return 0.0 if self.hole_drag is None else self.hole_drag.turn_s

    @property
    def follow_s(self) -> float:
        """Time constant of the drag [s]; 0 if it is off."""
        return 0.0 if self.hole_drag is None else self.hole_drag.follow_s

    def misfits(self, period_s: float, model: str) -> Iterator[Finding]:
        """Yield path and message of what does not go with a control period [s] and a model."""
        yield from _too_short(self.horizon_s, period_s)
        if model == "static" and self.hole_drag != HoleDragSettings():
            yield ("hole_drag",), "has no meaning with model: static; leave it out"
        if model == "static" and self.modes != MODES:
            yield ("modes",), "has no meaning with model: static; leave it out"
        if model == "static" and self.rest_gain is not None:
            yield ("rest_gain",), "has no meaning with model: static; leave it out"
        if model == "static" and self.tension_gap != TensionGapSettings():
            yield ("tension_gap",), "has no meaning with model: static; leave it out"
        if model == "static" and self.offset is not None and not self.offset.from_start:
            yield ("offset", "from_start"), "has no meaning with model: static; leave it out"

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> MultiStepSettings:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[Finding]:
        if self.horizon_s / self.instants > LONGEST_SPACING:
            yield ("instants",), f"must be so many that instants lie at most {LONGEST_SPACING:g} s apart"
        if self.blocks > self.instants:
            yield ("blocks",), f"must be at most instants, {self.instants}, not {self.blocks}"


class OneStepSettings(Settings):
    """One backward-Euler step as long as the horizon."""

    kind: Literal["one_step"]
    horizon_s: float = quantity("s", "prediction horizon, at least one control period", 0.8, gt=0, le=60)

    def misfits(self, period_s: float, model: str) -> Iterator[Finding]:
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

    def misfits(self, period_s: float, model: str) -> Iterator[Finding]:
        """Yield nothing: it has no horizon but the control period, and goes with both models."""
        del period_s, model
        yield from ()


def _too_short(horizon_s: float, period_s: float) -> Iterator[Finding]:
    if horizon_s < period_s:
        yield ("horizon_s",), f"must be at least period_s, {period_s:g}, not {horizon_s:g}"


Prediction: TypeAlias = Annotated[
    MultiStepSettings | OneStepSettings | LiteralSettings,
    Field(discriminator="kind"),
    ShortKind("multi_step", "one_step", "literal"),
]
"""Union of all kinds of prediction; the bare name of a kind stands for that kind with its defaults."""
