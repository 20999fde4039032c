"""Values that several trajectory settings share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, TypeAlias, TypeVar

from pydantic import AfterValidator

from tcrctl.config.settings import NotNegative as NotNegative
from tcrctl.config.settings import Positive as Positive
from tcrctl.config.settings import Vector as Vector

_Item = TypeVar("_Item")

DIRECTION_TOLERANCE = 1e-3  # directions typed with four decimals pass; the builders make them exactly unit


def _unit(vector: Vector) -> Vector:
    if abs(math.hypot(*vector) - 1.0) > DIRECTION_TOLERANCE:
        raise ValueError(f"must have length 1, it has {math.hypot(*vector):.6g}")
    return vector


Direction: TypeAlias = Annotated[Vector, AfterValidator(_unit)]


def not_empty(items: tuple[_Item, ...]) -> tuple[_Item, ...]:
    """Return the items, at least one; min_length would also complain when an item has an error of its own."""
    if not items:
        raise ValueError("needs at least 1 item, it has none")
    return items


def check_one_of(choices: Mapping[str, object], *, at_most: bool = False) -> None:
    """Raise ValueError unless exactly one (``at_most``: none or one) of the choices is not None."""
    given = [name for name, choice in choices.items() if choice is not None]
    if len(given) > 1 or not (given or at_most):
        number = "at most" if at_most else "exactly"
        raise ValueError(f"give {number} one of {', '.join(choices)}; given: {', '.join(given) or 'none'}")
