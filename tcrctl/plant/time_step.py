"""The internal time step of a simulated plant: given, or as long as the error that it makes may be."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

#: What is not said otherwise, and the step of plants whose drives, cables or cameras are not ideal [ms].
FIXED_MS: Final = 1.0
#: Longest step that is tried where steps are chosen [ms].
LONGEST_MS: Final = 5.0


def _must_be_auto(value: Any) -> Any:
    if value != "auto":
        raise PydanticCustomError("step", "must be a number or auto")
    return value


def _tag(value: Any) -> str:
    return "(auto)" if isinstance(value, str | None | bool | list | dict) else "(number)"


Step: TypeAlias = Annotated[
    Annotated[Literal["auto"], BeforeValidator(_must_be_auto), Tag("(auto)")]
    | Annotated[float, Field(gt=0), Tag("(number)")],
    Discriminator(_tag),
]


def fixed_ms(step: Step) -> float:
    """Return the step of a plant that goes step by step [ms]."""
    return FIXED_MS if step == "auto" else step
