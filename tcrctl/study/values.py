"""One number of a run by its dotted name, and which way is worse."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from tcrctl.study.row import Row

#: Names that end so are better the larger they are.
_LARGE_IS_GOOD: Final = (".min", ".detected", ".beam_passes")


def large_is_good(name: str) -> bool:
    """Tell whether a larger value of a measure is a better one."""
    return name.endswith(_LARGE_IS_GOOD)


def value_of(row: Row, name: str) -> float | None:
    """Return a measure of a run; None if the run has none.

    A run that did not come to its end is infinitely bad. Of a list, the worst entry counts.

    Args:
        row: The run.
        name: Dotted name as in ``run --json``; entries of a list are gone through: ``task.targets.beam_passes``.
    """
    good = large_is_good(name)
    if not row.finished:
        return -math.inf if good else math.inf
    values = [float(value) for value in _found(row.result, name) if isinstance(value, int | float)]
    if not values:
        return None
    return min(values) if good else max(values)


def _found(value: Any, name: str) -> Iterator[Any]:
    if isinstance(value, list):
        for item in value:
            yield from _found(item, name)
    elif not name:
        yield value
    elif isinstance(value, Mapping):
        head, _, tail = name.partition(".")
        yield from _found(value.get(head), tail)
