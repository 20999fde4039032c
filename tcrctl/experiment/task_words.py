"""The result of a task in words: a line for each thing that it lists, then what is true of all of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tcrctl.experiment.headline import number
from tcrctl.experiment.summary import SUFFIXES

#: Words for what a list of a task holds.
_OF_A: Final = {"targets": "target", "objects": "object"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing.

    Attributes:
        subject: What it is about: ``target level``, ``object key``; ``task`` for what is true of all.
        facts: Texts with units by name: ``position error`` is ``0.1506 mm``.
        at: When, if one of the facts is an instant [s].
    """

    subject: str
    facts: Mapping[str, str]
    at: float | None

    @property
    def text(self) -> str:
        """All facts in one line."""
        return ", ".join(f"{name} {said}" for name, said in self.facts.items())


def findings(task: Any) -> Iterator[Finding]:
    """Yield what a task found.

    Args:
        task: Object ``task`` of ``run --json``; anything else says nothing.
    """
    if not isinstance(task, Mapping):
        return
    for kind, items in task.items():
        for item in items if isinstance(items, list) else ():
            if isinstance(item, Mapping):
                rest = {key: value for key, value in item.items() if key != "name"}
                yield _finding(f"{_OF_A.get(kind, kind)} {item.get('name', '')}".strip(), rest)
    single = {key: value for key, value in task.items() if not isinstance(value, list)}
    if single:
        yield _finding("task", single)


def _finding(subject: str, values: Mapping[str, Any]) -> Finding:
    facts = dict(_fact(str(key), value) for key, value in values.items() if value is not None)
    times = [v for k, v in values.items() if k in _INSTANTS and isinstance(v, float | int)]
    return Finding(subject, facts, float(times[0]) if times else None)


#: Values that are instants of the run, not lengths of time.
_INSTANTS: Final = ("first_seen_s", "detection_s", "collision_s")


def _fact(key: str, value: Any) -> tuple[str, str]:
    """Return ``position error``, ``0.1506 mm``: a key that ends in its unit gives it to the number."""
    name, _, ending = key.rpartition("_")
    unit = SUFFIXES.get(ending, "")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if unit and name and is_number:
        return name.replace("_", " "), number(float(value), unit)
    return key.replace("_", " "), number(value)
