"""Settings of a study that exclude, replace or repeat one another: they would count for nothing, or twice."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, Protocol

from tcrctl.config.keys import Finding, Keys

#: The key of the seed, which is varied in another way.
SEED = "seed"


class Keyed(Protocol):
    """What a study says of the settings of its experiments; see :class:`tcrctl.study.settings.StudySpec`."""

    @property
    def set(self) -> Mapping[str, Any]:
        """What all runs have."""
        ...

    @property
    def cases(self) -> Mapping[str, Mapping[str, Any]]:
        """What differs together."""
        ...

    @property
    def vary(self) -> Mapping[str, Any]:
        """What each key takes by itself."""
        ...

    @property
    def design(self) -> str:
        """How that is combined."""
        ...


def key_conflicts(spec: Keyed) -> Iterator[Finding]:
    """Yield everything that is wrong with the keys of ``set``, ``vary`` and ``cases``, and with repeated values."""
    yield from _misshapen(spec)
    yield from _excluding(spec)
    yield from _lost(spec)
    yield from _repeated(spec)


def _overlap(a: str, b: str) -> bool:
    """Tell whether one key is the other or a section around it."""
    return f"{a}.".startswith(f"{b}.") or f"{b}.".startswith(f"{a}.")


def _sections(spec: Keyed) -> Iterator[tuple[Keys, Mapping[str, Any]]]:
    """Yield every section whose keys are settings of experiments."""
    yield ("set",), spec.set
    yield ("vary",), spec.vary
    for case, changes in spec.cases.items():
        yield ("cases", case), changes


def _misshapen(spec: Keyed) -> Iterator[Finding]:
    for section, keys in _sections(spec):
        for key in keys:
            if key != key.strip() or not all(key.split(".")):
                yield (*section, key), "must be a dotted key, for instance controller.period_s"


def _lost(spec: Keyed) -> Iterator[Finding]:
    """Yield keys that a section replaces that comes after them: what they say would count for nothing."""
    for section, keys in _sections(spec):
        if section != ("vary",):
            for first, second in combinations(keys, 2):
                if first.startswith(f"{second}."):
                    yield (*section, first), f"is replaced by {second}, which comes after it"
    for key in spec.set:
        for varied in spec.vary:
            if key.startswith(f"{varied}."):
                yield ("set", key), f"is replaced by {varied}, which is varied"


def _repeated(spec: Keyed) -> Iterator[Finding]:
    """Yield values that a grid has twice: the same run would count as two."""
    for key, axis in spec.vary.items() if spec.design == "grid" else ():
        seen = dict[str, None]()
        for i, value in enumerate(axis if isinstance(axis, tuple) else ()):
            text = json.dumps(value, sort_keys=True)
            if text in seen:
                yield ("vary", key, i), "is there already: the same run would count as two"
            seen[text] = None


def _excluding(spec: Keyed) -> Iterator[Finding]:
    for section, keys in (("set", spec.set), ("vary", spec.vary)):
        if SEED in keys:
            yield (section, SEED), "seeds are varied by seeds"
    for first, second in combinations(spec.vary, 2):
        if _overlap(first, second):
            yield ("vary", second), f"excludes {first}, which is varied too"
    for key in spec.vary:
        if key in spec.set:
            yield ("set", key), "is varied too"
        for case, changes in spec.cases.items():
            for other in changes:
                if _overlap(key, other):
                    yield ("cases", case, other), f"excludes {key}, which is varied too"
    for case, changes in spec.cases.items():
        if SEED in changes:
            yield ("cases", case, SEED), "seeds are varied by seeds"
