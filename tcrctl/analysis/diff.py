"""Two logs held against each other: settings, provenance, and every quantity of every step."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tcrctl.errors import TcrctlError
from tcrctl.log.comparison import Comparison, Deviation, Difference, quantities
from tcrctl.log.file_names import RESOLVED, ROBOT
from tcrctl.log.reader import Log, read_log
from tcrctl.log.run_files import RunFiles
from tcrctl.signals import StepRecord

#: Durations are never the same twice.
_LEFT_OUT: Final = ("timing.",)


@dataclass(frozen=True, slots=True)
class Entry:
    """One setting or fact that is not the same.

    Attributes:
        key: Dotted path of the setting, or name of the fact.
        a: Value in the first log; None if it has none.
        b: Value in the second log; None if it has none.
    """

    key: str
    a: Any
    b: Any

    def as_json(self) -> dict[str, Any]:
        """Return an item of ``settings`` or ``provenance`` in ``diff --json``."""
        return {"key": self.key, "a": self.a, "b": self.b}


@dataclass(frozen=True, slots=True)
class LogDiff:
    """What is different between two logs.

    Attributes:
        settings: Settings of experiment (``controller.horizon_s``) and robot (``robot.yaml: springs...``).
        provenance: Run, machine, versions; they do not count for ``same``.
        steps: Number of steps that only the first, only the second, and both logs have.
        first: First number that differs in a step that both have.
        deviations: Every quantity that differs; durations are not compared.
    """

    settings: tuple[Entry, ...]
    provenance: tuple[Entry, ...]
    steps: tuple[int, int, int]
    first: Difference | None
    deviations: tuple[Deviation, ...]

    @property
    def same(self) -> bool:
        """Same settings, and the same steps bit for bit."""
        return not (self.settings or self.first or self.steps[0] or self.steps[1])

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``diff --json``."""
        only_a, only_b, both = self.steps
        first = None if self.first is None else self.first.as_json()
        if first is not None:
            first["a"], first["b"] = first.pop("recorded"), first.pop("replayed")
        return {
            "status": "same" if self.same else "different",
            "settings": [entry.as_json() for entry in self.settings],
            "provenance": [entry.as_json() for entry in self.provenance],
            "steps": {"only_a": only_a, "only_b": only_b, "both": both},
            "first_difference": first,
            "deviations": [deviation.as_json() for deviation in self.deviations],
        }


def diff(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> LogDiff:
    """Compare two logs; steps of the same index are compared by bytes.

    Args:
        a: A log, finished or not.
        b: Another one.

    Raises:
        InputError: If one of them is not a log of tcrctl.
        LogError: If one of them is damaged inside.
    """
    one, other = read_log(a), read_log(b)
    comparison, counts = Comparison(quantities(*_LEFT_OUT)), [0, 0, 0]
    for first, second in _pairs(one.steps(), other.steps()):
        counts[0 if second is None else 1 if first is None else 2] += 1
        if first is not None and second is not None:
            comparison.add(first, second)
    return LogDiff(
        settings=_unequal(_settings(one), _settings(other)),
        provenance=_unequal(_provenance(one), _provenance(other)),
        steps=(counts[0], counts[1], counts[2]),
        first=comparison.first,
        deviations=tuple(comparison.deviations.values()),
    )


def _pairs(
    one: Iterator[StepRecord], other: Iterator[StepRecord]
) -> Iterator[tuple[StepRecord | None, StepRecord | None]]:
    """Yield steps of the same index together, and None where one side has no such step."""
    a, b = next(one, None), next(other, None)
    while a is not None and b is not None:
        if a.k == b.k:
            yield a, b
            a, b = next(one, None), next(other, None)
        elif a.k < b.k:
            yield a, None
            a = next(one, None)
        else:
            yield None, b
            b = next(other, None)
    yield from ((step, None) for step in itertools.chain([a] if a is not None else [], one))
    yield from ((None, step) for step in itertools.chain([b] if b is not None else [], other))


def _unequal(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Entry, ...]:
    keys = dict.fromkeys((*a, *b))
    return tuple(Entry(key, a.get(key), b.get(key)) for key in keys if a.get(key) != b.get(key))


def _settings(log: Log) -> dict[str, Any]:
    """Return settings by dotted key: those of the experiment as run, those of the robot after its file's name."""
    files = RunFiles(log)
    experiment, robot = _content(files, RESOLVED), _content(files, ROBOT)
    return {**dict(_flat(experiment)), **{f"{ROBOT}: {key}": value for key, value in _flat(robot)}}


def _content(files: RunFiles, name: str) -> Any:
    try:
        return files.document(name).data
    except TcrctlError:  # missing, or not YAML: then it differs from any other text
        return {"text": files.content(name).decode(errors="replace")}


def _flat(value: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Return the leaves of nested maps by dotted key; a list is a leaf."""
    if not isinstance(value, dict):
        if prefix:
            yield prefix, value
        return
    for key, item in value.items():
        yield from _flat(item, f"{prefix}.{key}" if prefix else str(key))


def _provenance(log: Log) -> dict[str, Any]:
    """Start record, outcome and versions by name."""
    outcome = {f"stop.{name}": (log.stop or {}).get(name, "") for name in ("status", "reason")}
    return {**log.start, **outcome, **RunFiles(log).versions()}
