"""The result of a run as the rows of a table for people; what went wrong comes first."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from tcrctl.experiment.headline import headline
from tcrctl.experiment.judgement import FINISHED, judgements
from tcrctl.experiment.task_words import findings

if TYPE_CHECKING:
    from tcrctl.experiment.summary import Summary

Row = tuple[str, str, str]

_COLOURS: Final = {"good": "green", "bad": "red", "quiet": "yellow"}


def rows(summary: Summary) -> Iterator[Row]:
    """Yield name, text and style of every row."""
    result = summary.as_json()
    yield "run", summary.run_id, ""
    stopped = "" if summary.status in FINISHED else f", stopped after {summary.measures.duration_s:.2f} s"
    yield "status", f"{summary.status}{stopped}", "bold green" if summary.exit_code == 0 else "bold red"
    judged = list(judgements(result))
    for judgement in judged:
        if judgement.style == "bad":
            yield "criterion", str(judgement), "red"
    yield "steps", f"{summary.measures.steps}, {summary.measures.duration_s:.2f} s", ""
    for line in headline(result):
        if line.first:
            yield line.name, line.text, "yellow" if line.trouble else ""
    for finding in findings(summary.task):
        yield finding.subject, finding.text, ""
    for judgement in judged:
        if judgement.style != "bad":
            yield "criterion", str(judgement), _COLOURS[judgement.style]
