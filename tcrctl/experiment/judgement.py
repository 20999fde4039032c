"""Criteria in words. Those of a run that was stopped are open, whatever the values were until then."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tcrctl.experiment.headline import number

#: What a run says of itself that has gone on to its end.
FINISHED: Final = ("success", "failed")
#: What one says that was ended before its time.
STOPPED: Final = ("aborted", "error")
_OPEN: Final = "open"


@dataclass(frozen=True, slots=True)
class Judgement:
    """One criterion.

    Attributes:
        name: Dotted name of the value, as in the experiment.
        value: What it was, with its unit.
        relation: How it is compared; empty if the log does not say.
        limit: With what, with its unit.
        verdict: ``passed``, ``FAILED``, or ``open``.
        style: ``good``, ``bad``, or ``quiet`` for neither.
    """

    name: str
    value: str
    relation: str
    limit: str
    verdict: str
    style: str

    @property
    def asked(self) -> str:
        """What was asked of the value: ``<= 3 mm``."""
        return f"{self.relation} {self.limit}".strip()

    @property
    def text(self) -> str:
        """Verdict, value and what was asked, for a place that has the name already."""
        return f"{self._said} {self.value}, must be {self.asked}"

    @property
    def _said(self) -> str:
        return f"{_OPEN}, the run was stopped: so far" if self.verdict == _OPEN else f"{self.verdict}:"

    def __str__(self) -> str:
        return f"{self._said} {self.name} is {self.value}, must be {self.asked}"


def judgements(result: Mapping[str, Any]) -> Iterator[Judgement]:
    """Yield every criterion of a run in words.

    Args:
        result: Object of ``run --json``, or part of it.
    """
    finished = result.get("status") in FINISHED
    for item in result.get("criteria") or ():
        unit = str(item.get("unit") or "")
        verdict, style = _verdict(bool(item.get("passed")), finished)
        value, limit = (_shown(item.get(key), unit) for key in ("value", "limit"))
        yield Judgement(str(item.get("name")), value, str(item.get("relation") or ""), limit, verdict, style)


def _verdict(passed: bool, finished: bool) -> tuple[str, str]:
    if not finished:
        return _OPEN, "quiet"
    return ("passed", "good") if passed else ("FAILED", "bad")


def _shown(value: Any, unit: str) -> str:
    """Write flags as in an experiment file."""
    return str(value).lower() if isinstance(value, bool) else number(value, unit)
