"""Named periodic deadlines."""

from __future__ import annotations


class Timers:
    """Deadlines that return after a period of their own [s]; all are due at once in the beginning."""

    def __init__(self, now: float, **periods: float) -> None:
        self._periods = periods
        self._next = dict.fromkeys(periods, now)

    def due(self, name: str, now: float) -> bool:
        """Tell whether the deadline has passed; if so, the next one is a period after ``now`` [s]."""
        if now < self._next[name]:
            return False
        self._next[name] = now + self._periods[name]
        return True

    def now_due(self, *names: str) -> None:
        """Make deadlines due at once."""
        for name in names:
            self._next[name] = float("-inf")

    def until_next(self, now: float) -> float:
        """Return the seconds from ``now`` to the next deadline; one that nobody asks for counts by its period."""
        waits = (at - now if at > now else self._periods[name] for name, at in self._next.items())
        return min(waits)
