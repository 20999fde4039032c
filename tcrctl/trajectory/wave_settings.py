"""What a ``trajectory:`` section of a sine, a chirp or steps of the drives may say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Final, Literal

from pydantic import AfterValidator, Field, model_validator

from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import quantity
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.values import NotNegative, Positive, not_empty

#: Fastest wave [Hz], and fewest control periods in one cycle of it.
FASTEST_HZ: Final = 20.0
FEWEST_PERIODS: Final = 8


class DriveProgramSection(TrajectorySection):
    """Drive lengths about a middle, and the end pose of the model at rest with them."""

    gives_drives: ClassVar[bool] = True

    kind: str
    middle_mm: tuple[float, ...] = quantity(
        "mm", "drive lengths of every cable about which it moves; zero if left out", ()
    )
    move_s: Positive = quantity("s", "time of the way to the middle, and back from it", 3.0)
    lead_in_s: NotNegative = quantity("s", "rest at the start", 1.0)
    settle_s: NotNegative = quantity("s", "rest at the very end", 2.0)

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place and drive lengths [mm] of what is given for every cable."""
        if self.middle_mm:
            yield ("middle_mm",), self.middle_mm


class WaveSection(DriveProgramSection):
    """Base of waves: all drives in one pattern, faded in and out."""

    amplitude_mm: Annotated[tuple[float, ...], AfterValidator(not_empty)] = quantity(
        "mm",
        "amplitude of every cable, in the order of the robot's cables; a negative one swings the other way",
    )
    fade_s: NotNegative = quantity(
        "s", "time in which the wave grows at its start and dies away at its end", 2.0
    )

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place and drive lengths [mm] of amplitude and middle."""
        yield ("amplitude_mm",), self.amplitude_mm
        yield from super().drives_named()

    @property
    def wave_s(self) -> float:
        """Time from the beginning of the wave to its end [s]."""
        raise NotImplementedError

    @property
    def fastest_hz(self) -> float:
        """Largest frequency [Hz]."""
        return max(value for _, value in self._frequencies())

    def misfits(self, period: float) -> Iterator[Finding]:
        """Yield frequencies of which a cycle has too few control periods."""
        limit = 1.0 / (FEWEST_PERIODS * period)
        for key, frequency in self._frequencies():
            if frequency > limit * (1.0 + 1e-9):
                of = f"{FEWEST_PERIODS} periods of {period:g} s in a cycle"
                yield (key,), f"must be at most {limit:g}, {of}, not {frequency:g}"

    def _frequencies(self) -> tuple[tuple[str, float], ...]:
        raise NotImplementedError

    def _check_fades(self) -> None:
        if 2.0 * self.fade_s > self.wave_s:
            raise ValueError(
                f"fade_s must be at most half of the wave's {self.wave_s:g} s, not {self.fade_s:g}"
            )


class SineSettings(WaveSection):
    """A sine of all drives, for the answer at one frequency."""

    kind: Literal["sine"]
    frequency_hz: Positive = quantity("Hz", "how fast", le=FASTEST_HZ)
    cycles: int = Field(ge=1, le=10000, description="how many there are, those that fade included")

    @model_validator(mode="after")
    def _fades_fit(self) -> SineSettings:
        self._check_fades()
        return self

    @property
    def wave_s(self) -> float:
        """All cycles [s]."""
        return self.cycles / self.frequency_hz

    def _frequencies(self) -> tuple[tuple[str, float], ...]:
        return (("frequency_hz", self.frequency_hz),)


class ChirpSettings(WaveSection):
    """A sine of all drives that becomes faster, or slower, for the answer over a band of frequencies."""

    kind: Literal["chirp"]
    from_hz: Positive = quantity("Hz", "frequency at the start", le=FASTEST_HZ)
    to_hz: Positive = quantity("Hz", "frequency at the end", le=FASTEST_HZ)
    duration_s: Positive = quantity("s", "time of the wave, fading included", le=86400.0)
    spacing: Literal["linear", "exponential"] = Field(
        default="exponential",
        description="how the frequency goes from start to end: as much per second, or as many octaves",
    )

    @model_validator(mode="after")
    def _fades_fit(self) -> ChirpSettings:
        self._check_fades()
        return self

    @property
    def wave_s(self) -> float:
        """As given [s]."""
        return self.duration_s

    def _frequencies(self) -> tuple[tuple[str, float], ...]:
        return (("from_hz", self.from_hz), ("to_hz", self.to_hz))


class StepsSettings(DriveProgramSection):
    """Steps of the drives, every one with a rest, for delays, play and the way to rest."""

    kind: Literal["steps"]
    levels_mm: Annotated[tuple[float, ...], AfterValidator(not_empty)] = quantity(
        "mm", "drive lengths one after the other, from the middle; the last step leads back to it"
    )
    cables: Literal["each", "together"] = Field(
        default="each",
        description="each: one cable after the other goes through all levels; together: all at once",
    )
    rise_s: Positive = quantity("s", "time of one step, at a constant speed", 0.3)
    rest_s: NotNegative = quantity("s", "rest after it", 3.0)
