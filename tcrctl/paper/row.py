"""One row of the comparison: what the paper reports, what must be reached, what was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from tcrctl.paper.job import Job

Result: TypeAlias = Mapping[str, Any]
"""The JSON object that a job printed."""
Verdict: TypeAlias = Literal["goal", "met", "missed", "shown", "failed", "not run"]
"""Better than the goal too; as it must be; not so; nothing is asked; a job failed; a job was not run."""


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table, before anything has been run.

    Attributes:
        name: Short name, as for ``--only``.
        work: What is done and measured.
        paper: What the paper reports, as text.
        unit: Unit of limit, goal and value; empty for a count.
        must: The bar; None if nothing is asked.
        goal: Where the project is going; None if nothing is asked.
        jobs: What has to be run.
        value: Number from the results of all jobs in order; None if they do not have it.
        at_least: Bar and goal are lower limits, not upper ones.
        text: More than the number says, from the results; may be left out.
        may_stop: A run that is stopped by a limit is a result, not a failure.
    """

    name: str
    work: str
    paper: str
    unit: str
    must: float | None
    goal: float | None
    jobs: tuple[Job, ...]
    value: Callable[[Sequence[Result]], float | None]
    at_least: bool = False
    text: Callable[[Sequence[Result]], str] | None = None
    may_stop: bool = False

    def reached(self, value: float, limit: float) -> bool:
        """Tell whether a value is as good as a limit."""
        return value >= limit if self.at_least else value <= limit

    def verdict(self, value: float | None) -> Verdict:
        """Hold a measured value against bar and goal."""
        if value is None:
            return "failed"
        if self.must is None and self.goal is None:
            return "shown"
        if self.must is not None and not self.reached(value, self.must):
            return "missed"
        if self.goal is not None and self.reached(value, self.goal):
            return "goal"
        return "met" if self.must is not None else "shown"


def worst(*names: str) -> Callable[[Sequence[Result]], float | None]:
    """Return what finds the largest of some values over all results.

    Args:
        *names: Dotted names of the values; a list is gone through item by item, ``task.targets.beam_passes``.
    """

    def find(results: Sequence[Result]) -> float | None:
        values = [value for result in results for name in names for value in found(result, name)]
        return max(values) if values and None not in values else None

    return find


def total(name: str) -> Callable[[Sequence[Result]], float | None]:
    """Return what adds up a value, or counts a flag, over all results; ``name`` as in :func:`worst`."""

    def find(results: Sequence[Result]) -> float | None:
        values = [value for result in results for value in found(result, name)]
        return float(sum(values)) if values and None not in values else None

    return find


def found(result: Any, name: str) -> list[Any]:
    """Return a dotted name's values in a result, one per item of lists on the way; None where there is none."""
    if isinstance(result, list):
        return [value for item in result for value in found(item, name)]
    if not name:
        return [result]
    head, _, tail = name.partition(".")
    return found(result.get(head), tail) if isinstance(result, Mapping) else [None]
