"""What a check found out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

#: Exit code of what must be put right before drives are armed.
NOT_READY: Final = 4


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of a check.

    Attributes:
        what: What was looked at.
        text: What was found.
        exit_code: 0 if it is as it should be; else what the program exits with.
    """

    what: str
    text: str
    exit_code: int = 0

    def as_json(self) -> dict[str, Any]:
        """Return the finding as an object."""
        return {**asdict(self), "ok": self.exit_code == 0}


def worst(findings: Sequence[Finding]) -> int:
    """Return the exit code of the first finding that is not as it should be; 0 if all are."""
    return next((finding.exit_code for finding in findings if finding.exit_code), 0)
