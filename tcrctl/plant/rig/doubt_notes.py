"""Markers that cannot be used are told once, not in every frame: hands and cables hide some all the time."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

#: Shortest time between two reports [s].
PAUSE: Final = 1.0


class DoubtNotes:
    """Reports when markers begin to be doubted for another reason, and when all are well again."""

    def __init__(self, report: Callable[[str, str, str], None], clock: Callable[[], float]) -> None:
        """Begin without doubts.

        Args:
            report: Takes kind, level and text.
            clock: Never jumps [s].
        """
        self._report, self._clock = report, clock
        self._reasons: frozenset[str] = frozenset()
        self._told = -PAUSE

    def note(self, doubts: str) -> None:
        """Take the doubts of one frame, for instance ``3 jump, 1 occluded``."""
        reasons = frozenset(re.sub(r"[0-9]+ ", "", part) for part in doubts.split(", ") if part)
        now = self._clock()
        if reasons == self._reasons or now - self._told < PAUSE:
            return
        self._reasons, self._told = reasons, now
        if doubts:
            self._report("markers", "warning", f"markers that cannot be used: {doubts}")
        else:
            self._report("markers", "info", "all markers can be used again")
