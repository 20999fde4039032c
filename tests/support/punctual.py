"""Tests in real time on a computer that may be busy: what fails while it was late is tried again."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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


class NoExcuseError(AssertionError):
    """A failure that counts however late the computer was."""


@contextmanager
def late_or_not() -> Iterator[None]:
    """Let what is asserted inside count at once: being late excuses times, not what the drives were told."""
    try:
        yield
    except AssertionError as failure:
        raise NoExcuseError(str(failure)) from failure


def on_a_punctual_computer(test: Callable[..., None]) -> Callable[..., None]:
    """Try a test again that failed while this computer was late; a failure in time is one at once.

    For tests whose fixtures are not used up by a run. The last try counts, late or not.
    """

    @functools.wraps(test)
    def tried(*args: object, **kwargs: object) -> None:
        for _ in range(TRIES - 1):
            with Lateness() as lateness:
                try:
                    return test(*args, **kwargs)
                except NoExcuseError:
                    raise
                except (Exception, pytest.fail.Exception):
                    if lateness.worst_s <= LATE_S:
                        raise
        return test(*args, **kwargs)

    return tried
