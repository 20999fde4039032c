"""Rows with what was measured, as a table, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from tcrctl.errors import StoppedError
from tcrctl.paper.job import Done, Job
from tcrctl.paper.over_seeds import STUDIES, OverSeeds
from tcrctl.paper.over_seeds import TITLES as PLANT_TITLES
from tcrctl.paper.row import Row, Verdict

TITLES: Final = ("work", "paper", "must reach", "going to", "measured", "verdict")
BAD: Final[tuple[Verdict, ...]] = ("missed", "failed")
_WORDS: Final[Mapping[Verdict, str]] = {
    "goal": "goal met",
    "met": "met",
    "missed": "MISSED",
    "shown": "-",
    "failed": "FAILED",
    "not run": "not run",
}


@dataclass(frozen=True, slots=True)
class Line:
    """A row with what was measured.

    Attributes:
        row: The row.
        value: The number; None if there is none.
        verdict: How it compares.
        reason: Why there is no number; empty if there is one.
        measured: The number with all that belongs to it, as text.
        logs: Logs of its runs.
        plants: The number over many plants as real as a laboratory's, by study, if that was asked.
    """

    row: Row
    value: float | None
    verdict: Verdict
    reason: str
    measured: str
    logs: tuple[str, ...]
    plants: Mapping[str, OverSeeds] = field(default_factory=dict)

    def cells(self, *, with_plants: bool = False) -> tuple[str, ...]:
        """Return texts in the order of :func:`titles`."""
        row, sign = self.row, ">= " if self.row.at_least else ""
        work = f"{row.work} [{row.unit}]" if row.unit else row.work
        bars = ("" if limit is None else f"{sign}{limit:g}" for limit in (row.must, row.goal))
        word = _WORDS[self.verdict]
        each = (self.plants.get(study) for study in STUDIES)
        plants = [cell for found in each for cell in (found.cells() if found else ("", "", ""))]
        verdict = f"{word}: {self.reason}" if self.reason else word
        return (work, row.paper, *bars, self.measured, verdict, *(plants if with_plants else ()))

    def as_json(self) -> dict[str, Any]:
        """Return the item of ``rows`` in ``tcrctl paper --json``."""
        row = self.row
        return {
            "name": row.name,
            "work": row.work,
            "unit": row.unit,
            "paper": row.paper,
            "must_reach": row.must,
            "going_to": row.goal,
            "measured": self.value,
            "text": self.measured,
            "verdict": self.verdict,
            "reason": self.reason,
            "logs": list(self.logs),
            **{
                key: self.plants[study].as_json() if study in self.plants else None
                for key, study in zip(("on_moderate_plants", "calibrated"), STUDIES, strict=True)
            },
        }

    def over(self, study: str, found: OverSeeds | None) -> Line:
        """Return the row with its number over the plants of a study, if it has one."""
        return self if found is None else replace(self, plants={**self.plants, study: found})


def make_line(row: Row, done: Mapping[Job, Done]) -> Line:
    """Measure a row by what became of its jobs; some may not have been run."""
    missing = [job for job in row.jobs if job not in done]
    failed = [done[job] for job in row.jobs if job in done and _is_failure(row, done[job])]
    logs = tuple(
        str(done[job].result["log"]) for job in row.jobs if job in done and "log" in done[job].result
    )
    if failed:
        reason = "; ".join(f"{item.job.label}: {item.reason}" for item in failed)
        return Line(row, None, "failed", reason, "", logs)
    if missing:
        part = f"{len(row.jobs) - len(missing)} of {len(row.jobs)} runs done" if len(row.jobs) > 1 else ""
        return Line(row, None, "not run", part, "", logs)
    results = [done[job].result for job in row.jobs]
    value = row.value(results)
    verdict = row.verdict(value)
    if value is None:
        return Line(row, None, verdict, "the runs do not have the value", "", logs)
    return Line(row, value, verdict, "", row.text(results) if row.text else f"{value:.3g}", logs)


def _is_failure(row: Row, item: Done) -> bool:
    stopped = item.code == StoppedError.exit_code and bool(item.result)
    return bool(item.reason) and not (row.may_stop and stopped)


def titles(lines: Sequence[Line]) -> tuple[str, ...]:
    """Return the titles of the columns; those of many plants if some row was run on them."""
    return (*TITLES, *PLANT_TITLES) if any(line.plants for line in lines) else TITLES


def cells(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Return texts of all rows, a cell for every title."""
    return [line.cells(with_plants=any(line.plants for line in lines)) for line in lines]


def markdown(lines: Sequence[Line], notes: Sequence[str]) -> str:
    """Return the table as Markdown.

    Args:
        lines: The rows.
        notes: Sentences below the table.
    """
    head = titles(lines)
    rows = [head, ("---",) * len(head), *cells(lines)]
    table = "\n".join("| " + " | ".join(_escaped(cell) for cell in row) + " |" for row in rows)
    return f"{table}\n\n{' '.join(notes)}\n"


def _escaped(cell: str) -> str:
    return cell.replace("|", "\\|").replace("\n", " ")
