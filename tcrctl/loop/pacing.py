"""When the steps of a run begin: at once, or by the clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final, Protocol

#: Longest time a wait goes without looking whether the run shall stop [s].
LONGEST_NAP: Final = 0.05


class Pace(Protocol):
    """Lets the steps begin."""

    def wait(self, t: float) -> float:
        """Wait until the step of time ``t`` [s] may begin; return how late it is [s].

        Raises:
            RunInterruptedError: If a signal asked the run to stop.
        """
        ...

    def now(self) -> float:
        """Return the time of a clock that never jumps, for measuring durations [s]."""
        ...

    def time(self) -> float:
        """Return the time of the run [s]: that of the step that is due now; 0 before the first."""
        ...

    def moment(self) -> float:
        """Return when an event happens that happens now [s]: between the step that is due and the next one."""
        ...

    def elapsed(self) -> float:
        """Return how long ago the first step began [s], missed steps counted: what waits, waits by this time."""
        ...

    def behind(self) -> float:
        """Return how long ago the step that is due now should have begun [s]; not more than 0 if it is not late."""
        ...

    def end(self) -> None:
        """Note that no further step will come."""
        ...


def _go_on() -> None:
    """Do nothing: nothing asks the run to stop."""


class Unpaced:
    """Every step begins as soon as the one before has ended: simulation as fast as it goes."""

    def __init__(self, check: Callable[[], None] = _go_on) -> None:
        """Make a pace; ``check`` raises if the run shall stop."""
        self._check, self._time = check, 0.0

    def wait(self, t: float) -> float:
        """Do not wait; never late."""
        self._check()
        self._time = t
        return 0.0

    def time(self) -> float:
        """Return the time of the last step [s]."""
        return self._time

    def moment(self) -> float:
        """Return the time of the last step [s]."""
        return self._time

    def elapsed(self) -> float:
        """Return the time of the last step [s]."""
        return self._time

    def behind(self) -> float:
        """Return 0: no step is ever late."""
        return 0.0

    def end(self) -> None:
        """Do nothing: time goes by steps alone."""

    def now(self) -> float:
        """Return the performance counter [s]."""
        return time.perf_counter()


class RealTime:
    """Step k begins at the start plus k periods, whatever the steps before took.

    A step that is late by less than a period does not move the ones after it. One that is later does: the run
    goes on from there at its own rate, because the steps that were missed cannot be made up for, and a burst
    of them would send the robot commands meant for other times.
    """

    def __init__(
        self,
        period: float,
        check: Callable[[], None] = _go_on,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Make a pace whose clock starts with the first wait.

        Args:
            period: Time between two steps [s].
            check: Raises if the run shall stop.
            clock: Never jumps [s].
            sleep: Waits for a time [s].
        """
        self._period = period
        self._check = check
        self._clock = clock
        self._sleep = sleep
        self._start: float | None = None
        self._first, self._due, self._should, self._ended = 0.0, 0.0, 0.0, False

    def wait(self, t: float) -> float:
        """Wait until the start plus ``t``; return the lateness [s]."""
        self._check()
        self._due = t
        if self._start is None:
            self._first = self._clock()
            self._start = self._first - t
        self._should = self._start + t
        while (left := self._start + t - self._clock()) > 0.0:
            self._sleep(min(left, LONGEST_NAP))
            self._check()
        late = -left
        if late > self._period:
            self._start += late
        return late

    def now(self) -> float:
        """Return the clock [s]."""
        return self._clock()

    def time(self) -> float:
        """Return the time since the start [s]; missed steps are not counted."""
        return 0.0 if self._start is None else self._clock() - self._start

    def moment(self) -> float:
        """Return the time since the start [s], in a step that takes too long that of the next one.

        Steps that come after it begin no earlier, so events and steps stay in order. After the last step time is
        not held back.
        """
        return self.time() if self._ended else min(self.time(), self._due + self._period)

    def elapsed(self) -> float:
        """Return the time since the first step began [s]; 0 before it."""
        return 0.0 if self._start is None else self._clock() - self._first

    def behind(self) -> float:
        """Return the time since the step that is due now should have begun [s], its own lateness counted."""
        return 0.0 if self._start is None else self._clock() - self._should

    def end(self) -> None:
        """Note that no further step will come."""
        self._ended = True
