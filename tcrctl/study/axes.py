"""What a setting takes in a study: values one by one, a range, a distribution."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    PlainSerializer,
    Tag,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from tcrctl.config.settings import Settings, refuse

#: More runs than this are a mistake.
MOST_RUNS = 1_000_000


class RangeSettings(Settings):
    """Numbers from ``low`` to ``high``."""

    low: float = Field(description="smallest value")
    high: float = Field(description="largest value")
    scale: Literal["linear", "log"] = Field(
        default="linear", description="what is spread evenly: the value or its log"
    )
    steps: int | None = Field(
        default=None, ge=2, le=MOST_RUNS, description="how many values; designs grid and zip"
    )
    whole: bool = Field(default=False, description="whole numbers only")

    @model_validator(mode="after")
    def _in_order(self) -> RangeSettings:
        if self.low >= self.high:
            refuse([(("high",), f"must be above low, {self.low:g}, not {self.high:g}")])
        if self.scale == "log" and self.low <= 0.0:
            refuse([(("low",), f"must be > 0 with scale: log, not {self.low:g}")])
        return self


class NormalSettings(Settings):
    """Numbers of a normal distribution, cut off at three standard deviations."""

    mean: float = Field(description="mean")
    std: float = Field(gt=0, description="standard deviation")


Values: TypeAlias = Annotated[tuple[Any, ...], Field(min_length=1)]


def _axis_tag(value: Any) -> str:
    if not isinstance(value, dict | Settings):
        return "(values)"  # or none of the three: one value is no list
    keys = value.keys() if isinstance(value, dict) else type(value).model_fields
    return "(normal)" if "mean" in keys or "std" in keys else "(range)"


Axis: TypeAlias = Annotated[
    Annotated[Values, Tag("(values)")]
    | Annotated[RangeSettings, Tag("(range)")]
    | Annotated[NormalSettings, Tag("(normal)")],
    Discriminator(_axis_tag),
]
"""A list of values, a range, or a normal distribution."""


def _seeds(value: Any) -> Any:
    """Read ``0..9``; a list is left to pydantic."""
    if not isinstance(value, str):
        return value
    first, dots, last = (part.strip() for part in value.partition(".."))
    if not (dots and first.isdecimal() and last.isdecimal() and len(first) < 19 and len(last) < 19):
        raise PydanticCustomError("seeds", "must be a list of whole numbers, or FIRST..LAST")
    count = int(last) - int(first) + 1
    if not 1 <= count <= MOST_RUNS:
        raise PydanticCustomError(
            "seeds", "must be 1 to {most} seeds; this is {count}", {"most": MOST_RUNS, "count": max(count, 0)}
        )
    return tuple(range(int(first), int(last) + 1))


def _different(seeds: tuple[int, ...]) -> tuple[int, ...]:
    """Refuse a seed that is there twice: the same run would count as two."""
    if len(set(seeds)) < len(seeds):
        twice = next(seed for seed, count in Counter(seeds).items() if count > 1)
        raise PydanticCustomError("seeds", "seed {seed} is given twice", {"seed": twice})
    return seeds


def _shortly(seeds: tuple[int, ...]) -> str | list[int]:
    first, last = seeds[0], seeds[-1]
    return f"{first}..{last}" if seeds == tuple(range(first, last + 1)) else list(seeds)


Seed: TypeAlias = Annotated[int, Field(ge=0, lt=2**63)]
Seeds: TypeAlias = Annotated[
    Annotated[tuple[Seed, ...], Field(min_length=1, strict=False)],
    BeforeValidator(_seeds),
    AfterValidator(_different),
    PlainSerializer(_shortly),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": r"^\s*[0-9]+\s*\.\.\s*[0-9]+\s*$"},
                {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1},
            ]
        }
    ),
]
