"""What a run must achieve: ``name relation limit``, for instance ``position_error_mm.max <= 3.0``."""

from __future__ import annotations

import json
import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

RELATIONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le,
    "<": operator.lt,
    ">=": operator.ge,
    ">": operator.gt,
    "==": operator.eq,
}
_NAME = r"[a-z][a-z0-9_]*(?:\.[a-z0-9_]+)*"
_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_PATTERN = rf"^\s*({_NAME})\s*(<=|>=|==|<|>)\s*({_NUMBER}|true|false)\s*$"


@dataclass(frozen=True, slots=True)
class Criterion:
    """One condition on the result of a run.

    Attributes:
        name: Dotted name of a value in the result, as in ``run --json``.
        relation: One of the keys of ``RELATIONS``.
        limit: What the value is compared with, in the unit of the value; true or false for a flag.
    """

    name: str
    relation: str
    limit: float | bool

    def holds(self, value: float | bool) -> bool:
        """Tell whether a value meets the condition; NaN never does.

        Args:
            value: The value of that name.
        """
        return RELATIONS[self.relation](value, self.limit)

    def __str__(self) -> str:
        return f"{self.name} {self.relation} {json.dumps(self.limit).removesuffix('.0')}"


def parse_criterion(text: Any) -> Criterion:
    """Return the criterion that a text describes.

    Args:
        text: ``name relation limit``.

    Raises:
        PydanticCustomError: If it describes none.
    """
    if isinstance(text, Criterion):
        return text
    match = re.match(_PATTERN, text) if isinstance(text, str) else None
    limit = _limit(match[3]) if match else 0.0
    if match is None or not math.isfinite(limit):
        expected = f"name relation number, with one of {' '.join(RELATIONS)}"
        raise PydanticCustomError("criterion", "must be {expected}", {"expected": expected})
    return Criterion(match[1], match[2], limit)


def _limit(text: str) -> float | bool:
    return text == "true" if text in ("true", "false") else float(text)


CriterionText: TypeAlias = Annotated[
    Criterion,
    PlainValidator(parse_criterion),
    PlainSerializer(str, return_type=str),
    WithJsonSchema({"type": "string", "pattern": _PATTERN, "examples": ["position_error_mm.max <= 3.0"]}),
]
