"""Tests in real time on a computer that may be busy: what fails while it was late is tried again."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable

import pytest

SLEEP_S = 0.005
#: A computer that wakes a thread later than this cannot keep the times of a bench [s].
LATE_S = 0.03
TRIES = 4


class Lateness:
    """The latest that a thread of this process was woken, while the context lasts.

    Attributes:
        worst_s: That time [s].
    """

    def __init__(self) -> None:
        self.worst_s = 0.0
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Lateness:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._done.is_set():
            asleep = time.monotonic()
            time.sleep(SLEEP_S)
            self.worst_s = max(self.worst_s, time.monotonic() - asleep - SLEEP_S)


def on_a_punctual_computer(test: Callable[..., None]) -> Callable[..., None]:
    """Try a test again that failed while this computer was late; a failure in time is one at once.

    A computer that is late in every try cannot judge: the test is skipped and says so. For tests whose fixtures
    are not used up by a run.
    """

    @functools.wraps(test)
    def tried(*args: object, **kwargs: object) -> None:
        for _ in range(TRIES):
            with Lateness() as lateness:
                try:
                    return test(*args, **kwargs)
                except (Exception, pytest.fail.Exception) as failure:
                    failed = failure
                finally:
                    worst_s = lateness.worst_s
            if worst_s <= LATE_S:
                raise failed
        pytest.skip(f"this computer wakes a thread {1e3 * worst_s:.0f} ms late: {failed}")

    return tried
