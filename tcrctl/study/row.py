"""What is kept of a run that is done."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

Status: TypeAlias = Literal["success", "failed", "aborted", "error", "infeasible", "timeout", "crashed"]
"""As in ``run --json``; and: path or robot were refused, the time limit was passed, the process died."""

#: Runs that came to their end.
FINISHED: Final[tuple[Status, ...]] = ("success", "failed")
#: What is an answer of the experiment: that a limit stopped it, or that its path was refused, is one too.
ANSWERS: Final[tuple[Status, ...]] = (*FINISHED, "aborted", "infeasible")
#: Exit code of what was asked of runs, some of which have no result.
WITHOUT_RESULT: Final = 3
#: Exit codes from here on are signals: the run says nothing of the experiment.
SIGNALS: Final = 128
#: Results that no two runs have in common.
TIMING: Final = ("control_ms", "latency_ms", "overruns")
#: Results that are not of the run, or stand elsewhere in the row.
_ELSEWHERE: Final = ("run_id", "overrides", "status", "reason", "log", "versions", *TIMING)


@dataclass(frozen=True, slots=True)
class Row:
    """A run that is done.

    Attributes:
        address: What it is found by.
        status: How it ended.
        reason: Why; empty for success.
        result: Object of ``run --json`` as far as it is the same every time; empty if there is none.
        seconds: Wall time [s].
        timing: What ``run --json`` says of the time that steps took.
        log: The log, if one was kept.
        path: Trajectory that was drawn, and how many were refused before; empty if none was.
        program: Digest of the program that ran it, :func:`tcrctl.study.address.program`.
    """

    address: str
    status: Status
    reason: str
    result: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    timing: Mapping[str, Any] = field(default_factory=dict)
    log: str | None = None
    path: Mapping[str, Any] = field(default_factory=dict)
    program: str = ""

    @property
    def finished(self) -> bool:
        """Whether the run came to its end."""
        return self.status in FINISHED

    @property
    def answered(self) -> bool:
        """Whether the run says something of the experiment; one that crashed or timed out may be tried again."""
        return self.status in ANSWERS

    def dumps(self) -> bytes:
        """Return the row as one line of JSON."""
        return json.dumps(dataclasses.asdict(self), separators=(",", ":")).encode() + b"\n"


def unanswered(rows: Sequence[Row]) -> str:
    """Say how many runs crashed, timed out or ended in an error; nothing if none did."""
    found = Counter(row.status for row in rows if not row.answered)
    kinds = ", ".join(f"{count} {status}" for status, count in sorted(found.items()))
    return f"{found.total()} of {len(rows)} runs without a result: {kinds}" if found else ""


def loads(line: bytes) -> Row | None:
    """Read a line; return None if it is not one that was written whole, or holds values of other types."""
    try:
        row = Row(**json.loads(line))
    except (ValueError, TypeError, RecursionError):
        return None
    return row if line.endswith(b"\n") and _is_sound(row) else None


def _is_sound(row: Row) -> bool:
    texts = (row.address, row.reason, row.program, "" if row.log is None else row.log)
    maps = (row.result, row.timing, row.path)
    return (
        row.status in get_args(Status)
        and all(isinstance(text, str) for text in texts)
        and all(isinstance(part, dict) for part in maps)
        and isinstance(row.seconds, int | float)
    )


def same_every_time(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of a result that does not depend on when and where the run was."""
    return {key: value for key, value in result.items() if key not in _ELSEWHERE}
