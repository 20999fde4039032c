"""What a fault script may say of the cameras: names of faults, and their values as ``MotiveFaults`` wants them."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Collection, Iterator
from typing import Any, Final

from tcr_hardware.emulators.motive_faults import MotiveFaults

DEFAULTS: Final = MotiveFaults()
#: What is no attribute of ``MotiveFaults``, and the kind of its value.
CHANGES: Final = {"version": "", "renamed": False}
CAMERA_FAULTS: Final = (*(field.name for field in dataclasses.fields(MotiveFaults)), *CHANGES)
#: Camera faults that are shares of all frames.
SHARES: Final = ("loss", "duplicate", "corrupt", "truncate", "wrong_size", "second_source")
#: Camera faults that name markers, bodies, or either.
MARKERS: Final = ("occluded", "missing", "nan", "swap")
BODIES: Final = ("pivot", "moved_labels", "exchanged")
EITHER: Final = ("drifting",)


def wrong_value(name: str, value: Any) -> str:
    """Say what is wrong with the value of a camera fault; empty if nothing is."""
    try:
        taken = camera_value(name, value)
    except (TypeError, ValueError) as error:
        return str(error)
    if name in SHARES and not 0 <= taken <= 1:
        return f"must be a share of the frames, 0 to 1, not {value!r}"
    if name in ("delay_s", "reorder") and not 0 <= taken < math.inf:
        return f"must be >= 0, not {value!r}"
    return ""


def camera_value(name: str, value: Any) -> Any:
    """Return a value from a file as the attribute of ``MotiveFaults`` wants it.

    Raises:
        ValueError: If it is not of that kind.
    """
    if name == "version" and isinstance(value, str) and re.fullmatch(r"[0-9]+\.[0-9]+", value):
        return value
    kind = _kind(name)
    if kind in _TAKEN and _TAKEN[kind][0](value):
        return _TAKEN[kind][1](value)
    if kind in (bool, int, float) and type(value) in (kind, int) and (kind is bool) == (type(value) is bool):
        return kind(value)
    if name == "pivot" and isinstance(value, str):
        return value
    raise ValueError(f"must be {_SPECIAL.get(name) or _NAMES[kind]}, not {value!r}")


def names_in(value: Any) -> Iterator[str]:
    """Yield the names of markers and bodies in the value of a camera fault."""
    for item in [value] if isinstance(value, str) else value:
        yield from [item] if isinstance(item, str) else item


def known_names(fault: str, markers: Collection[str]) -> list[str]:
    """Return the names that a camera fault may give, out of those of all markers; none if it gives no names."""
    bodies = list(dict.fromkeys(name.rpartition(".")[0] or "markers" for name in markers))
    return [
        *(markers if fault in (*MARKERS, *EITHER) else ()),
        *(bodies if fault in (*BODIES, *EITHER) else ()),
    ]


def _kind(name: str) -> Any:
    """Return the kind of a value: that of its default, or ``pairs`` or ``vector`` for the two kinds of tuples."""
    default = CHANGES[name] if name in CHANGES else getattr(DEFAULTS, name)
    return type(default) if not isinstance(default, tuple) else "vector" if default else "pairs"


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _are_pairs(value: Any) -> bool:
    return isinstance(value, list) and all(_are_names(pair) and len(pair) == 2 for pair in value)


def _is_vector(value: Any) -> bool:
    numbers = isinstance(value, list) and all(type(item) in (int, float) for item in value)
    return numbers and len(value) == 3 and all(math.isfinite(item) for item in value)


_TAKEN: Final[dict[Any, tuple[Callable[[Any], bool], Callable[[Any], Any]]]] = {
    frozenset: (_are_names, frozenset),
    "pairs": (_are_pairs, lambda value: tuple((first, second) for first, second in value)),
    "vector": (_is_vector, lambda value: tuple(float(item) for item in value)),
}
_NAMES: Final[dict[Any, str]] = {
    str: "text",
    frozenset: "a list of marker names",
    "pairs": "a list of pairs of marker names",
    "vector": "three numbers",
    bool: "true or false",
    int: "a whole number",
    float: "a number",
}
_SPECIAL: Final = {
    "version": "a version such as '3.1'",
    "pivot": "the name of a body",
    "moved_labels": "a list of bodies",
    "exchanged": "a list of pairs of bodies",
    "drifting": "a list of markers and bodies",
}
