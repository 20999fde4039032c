"""The result of a task in words: a line for each thing that it lists, then what is true of all of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tcrctl.experiment.headline import number
from tcrctl.experiment.summary import SUFFIXES

#: Words for what a list of a task holds.
_OF_A: Final = {"targets": "target", "objects": "object"}
#: Words for flags that are set, and that are not.
_FLAGS: Final = {
    "detected": ("seen", "never seen"),
    "beam_passes": ("the beam goes through", "the beam does not go through"),
    "collision": ("collision", "no collision"),
}
_NAMES: Final = {
    "first_seen_s": "first at",
    "detected": "objects seen:",
    "detection_s": "all seen at",
    "collision_s": "at",
    "collision_between": "between",
}
#: Values that are instants of the run, not lengths of time.
_INSTANTS: Final = ("first_seen_s", "collision_s", "detection_s")


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing.

    Attributes:
        subject: What it is about: ``target level``, ``object key``; ``task`` for what is true of all.
        facts: What was found, with units: ``position error 0.1506 mm``.
        at: When, if one of the facts is an instant [s].
    """

    subject: str
    facts: tuple[str, ...]
    at: float | None

    @property
    def text(self) -> str:
        """All facts in one line."""
        return ", ".join(self.facts)


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
    known = [(str(key), value) for key, value in values.items() if value is not None]
    known.sort(key=lambda item: not isinstance(item[1], bool))  # what was asked comes first, then how well
    facts = tuple(_fact(key, value) for key, value in known)
    times = [values[key] for key in _INSTANTS if isinstance(values.get(key), float | int)]
    return Finding(subject, facts, float(times[0]) if times else None)


def _fact(key: str, value: Any) -> str:
    """Return ``position error 0.1506 mm``: a key that ends in its unit gives it to the number."""
    if isinstance(value, bool):
        yes, no = _FLAGS.get(key, (f"{key.replace('_', ' ')} yes", f"{key.replace('_', ' ')} no"))
        return yes if value else no
    name, _, ending = key.rpartition("_")
    unit = SUFFIXES.get(ending, "") if name and isinstance(value, int | float) else ""
    said = number(float(value), unit) if unit else number(value)
    return f"{_NAMES.get(key, (name if unit else key).replace('_', ' '))} {said}"
