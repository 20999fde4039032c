"""Work handed out piece by piece; what becomes of each, as it comes, also if its process dies.

A process that ends by itself breaks a whole executor, and nobody says whose work it was. So everything that was in
the air is done again, one piece at a time; what then ends its process twice is known, and is a crash.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass, field
from itertools import islice
from typing import Final, Generic, TypeVar

from tcrctl.errors import DeviceError
from tcrctl.executors.engine import Engine
from tcrctl.executors.workers import Workers

T = TypeVar("T")
R = TypeVar("R")
_POLL_S: Final = 0.2
_ENDED: Final = "its process ended by itself, twice: killed, or out of memory"


@dataclass(frozen=True, slots=True)
class Crash:
    """A piece of work that ended with its process.

    Attributes:
        reason: Why.
    """

    reason: str


def _nothing() -> None:
    """Find nothing."""


def _untold(item: object) -> None:
    """Tell nobody."""


def outcomes(
    engine: Engine,
    function: Callable[[T], R],
    items: Iterable[T],
    *,
    check: Callable[[], None] = _nothing,
    begun: Callable[[T], None] = _untold,
    deadline_s: float | None = None,
    warm: Callable[[], object] | None = None,
) -> Iterator[tuple[T, R | Crash]]:
    """Yield every piece of work with its result, in the order in which they end.

    Args:
        engine: Where.
        function: What is done; must be picklable, as its argument and its result.
        items: The pieces; taken from the iterator when there is room.
        check: Called several times a second; what it raises ends everything.
        begun: Is told what is handed out.
        deadline_s: A piece that takes longer is a crash, where processes can be killed [s].
        warm: As in :meth:`Engine.open`.

    Raises:
        DeviceError: If the scheduler of a cluster is lost.
    """
    work = _Work(function, iter(items), check, begun, deadline_s)
    while True:
        with engine.open(warm) as workers:
            if not (yield from work.until_broken(workers)):
                return


@dataclass
class _Work(Generic[T, R]):
    """What is left to be done, and what is in the air."""

    function: Callable[[T], R]
    source: Iterator[T]
    check: Callable[[], None]
    begun: Callable[[T], None]
    deadline_s: float | None
    again: deque[T] = field(default_factory=deque)
    suspects: deque[T] = field(default_factory=deque)
    on_trial: bool = False
    blamed: T | None = None
    flight: dict[Future[R], tuple[T, float]] = field(default_factory=dict)

    def until_broken(self, workers: Workers) -> Generator[tuple[T, R | Crash], None, bool]:
        """Yield outcomes until everything is done, and return False; or until the executor is broken: True."""
        try:
            while self._handed_out(workers):
                done, _ = wait(self.flight, timeout=_POLL_S, return_when=FIRST_COMPLETED)
                self.check()
                for future in done:
                    yield self._landed(future)
                yield from self._late(workers)
        except BrokenExecutor:
            yield from self._lost()
            return True
        return False

    def _handed_out(self, workers: Workers) -> bool:
        """Hand out what there is room for, what is suspected alone; return False if there is nothing left."""
        while len(self.flight) < (1 if self.suspects or self.on_trial else workers.width):
            queue = self.suspects or self.again
            self.on_trial = bool(self.suspects)
            if not queue:
                queue.extend(islice(self.source, 1))
            if not queue:
                break
            future = workers.executor.submit(self.function, queue[0])
            item = queue.popleft()  # not before: a broken executor takes nothing
            self.flight[future] = item, time.monotonic()
            self.begun(item)
        return bool(self.flight)

    def _landed(self, future: Future[R]) -> tuple[T, R | Crash]:
        outcome: R | Crash
        try:
            outcome = future.result()
        except BrokenExecutor:
            raise
        except CancelledError:
            raise DeviceError(
                "the scheduler has gone, and what it was doing with it",
                hint="Start again: what is done is kept.",
            ) from None
        except Exception as error:
            outcome = Crash(f"{type(error).__name__}: {error}")
        item, _ = self.flight.pop(future)
        self.on_trial = False
        return item, outcome

    def _late(self, workers: Workers) -> Iterator[tuple[T, R | Crash]]:
        """End the processes if a piece of work is late; what else they were doing is done again."""
        if self.deadline_s is None or workers.kill is None:
            return
        limit = time.monotonic() - self.deadline_s
        late = [future for future, (_, begun) in self.flight.items() if begun < limit]
        if not late:
            return
        workers.kill()
        for future in late:
            item, _ = self.flight.pop(future)
            yield item, Crash(f"took longer than {self.deadline_s:g} s; its process was ended")
        self.again.extend(item for item, _ in self.flight.values())
        self.flight.clear()
        self.on_trial = False
        raise BrokenExecutor

    def _lost(self) -> Iterator[tuple[T, R | Crash]]:
        """Suspect what was in the air; find guilty what dies alone twice in a row."""
        lost = [item for item, _ in self.flight.values()]
        self.flight.clear()
        if not self.on_trial:
            self.suspects.extend(lost)
            return
        self.on_trial = False
        for item in lost:
            if item is self.blamed:
                yield item, Crash(_ENDED)
            else:  # perhaps somebody else killed it
                self.blamed = item
                self.suspects.appendleft(item)
