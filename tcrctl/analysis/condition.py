"""A condition on the values of a run: ``controller.kind=ioc and position_error_mm.max<1``."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from tcrctl.errors import InputError

Value: TypeAlias = str | int | float | bool | None

_RELATIONS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "<=": operator.le, ">=": operator.ge, "!=": operator.ne, "==": operator.eq, "<": operator.lt,
    ">": operator.gt, "=": operator.eq,
}  # fmt: skip
_TERM: Final = re.compile(r"\s*([A-Za-z_][\w.]*)\s*(<=|>=|!=|==|<|>|=)\s*(.+?)\s*")
_LITERALS: Final[dict[str, Value]] = {"true": True, "false": False, "none": None}


@dataclass(frozen=True, slots=True)
class Term:
    """One comparison.

    Attributes:
        name: Dotted name of the value.
        relation: One of ``<= >= != == < > =``.
        wanted: What it is compared with.
    """

    name: str
    relation: str
    wanted: Value

    def holds(self, value: Value) -> bool:
        """Tell whether a value meets it; what is not there is only unequal, and text has no order with numbers."""
        if self.relation in ("=", "==", "!="):
            same = _comparable(value, self.wanted) and value == self.wanted
            return same == (self.relation != "!=")
        if value is None or not _comparable(value, self.wanted):
            return False
        return _RELATIONS[self.relation](value, self.wanted)


def _comparable(a: Value, b: Value) -> bool:
    kinds = [str if isinstance(v, str) else bool if isinstance(v, bool) else type(None) if v is None else float
             for v in (a, b)]  # fmt: skip
    return kinds[0] is kinds[1]


@dataclass(frozen=True, slots=True)
class Condition:
    """Comparisons that must all hold."""

    terms: tuple[Term, ...]

    def holds(self, value: Callable[[str], Value]) -> bool:
        """Tell whether all hold.

        Args:
            value: Returns the value of a dotted name.
        """
        return all(term.holds(value(term.name)) for term in self.terms)


def parse_condition(text: str) -> Condition:
    """Return the condition that a text describes.

    Args:
        text: Comparisons with ``and`` between them; quotes round text that has spaces.

    Raises:
        InputError: If it describes none.
    """
    return Condition(tuple(_term(part) for part in re.split(r"\s+and(?:\s+|$)", text)))


def _term(text: str) -> Term:
    match = _TERM.fullmatch(text)
    if match is None:
        raise InputError(
            f"--where: {text.strip() or 'nothing'!r} is no comparison",
            hint="For instance: --where 'controller.kind=ioc and position_error_mm.max<1'",
        )
    return Term(match[1], match[2], _literal(match[3]))


def _literal(text: str) -> Value:
    if text.lower() in _LITERALS:
        return _LITERALS[text.lower()]
    if len(text) > 1 and text[0] == text[-1] and text[0] in "'\"":
        return text[1:-1]
    try:
        return float(text)
    except ValueError:
        return text
