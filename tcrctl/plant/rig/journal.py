"""Events of a plant, kept until there is a log to take them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from tcrctl.errors import LogError

#: Levels that are also told to the user at once.
LOUD: Final = ("warning", "error", "fatal")

_DIGITS: Final = re.compile(r"[0-9.]+")

Sink = Callable[[float, str, str, str], None]


class Journal:
    """Takes events at any time; a log that fails never keeps a supervisor from stopping the drives."""

    def __init__(self, time: Callable[[], float], notify: Callable[[str], None]) -> None:
        """Begin without a log.

        Args:
            time: Time of the run [s].
            notify: Takes warnings and errors for the user.
        """
        self._time, self._notify = time, notify
        self._times: Counter[str] = Counter()
        self._waiting: list[tuple[float, str, str, str]] = []
        self._sink: Sink | None = None

    def attach(self, sink: Sink) -> None:
        """Hand over what has happened, and everything from now on; ``sink`` takes time, kind, level and text."""
        self._sink = sink
        waiting, self._waiting = self._waiting, []
        for event in waiting:
            self._write(event)

    def report(self, kind: str, level: str, text: str) -> None:
        """Take an event that happens now."""
        self._write((self._time(), kind, level, text))
        if level in LOUD:
            self._tell(level, text)

    def _tell(self, level: str, text: str) -> None:
        """Tell the user; what repeats itself only the 1st, 2nd, 4th, 8th ... time. The log has all."""
        sort = _DIGITS.sub("", text)
        self._times[sort] += 1
        times = self._times[sort]
        if times & (times - 1) == 0:
            self._notify(f"{level}: {text}{f' ({times} times so far)' if times > 2 else ''}")

    def _write(self, event: tuple[float, str, str, str]) -> None:
        if self._sink is None:
            self._waiting.append(event)
            return
        with suppress(LogError):  # the loop meets the same error with its next step, and stops for it
            self._sink(*event)
