"""Ctrl-C and SIGTERM during a run: the first one stops it between two steps, the second one at once."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, NoReturn, Self

from tcrctl.errors import RunInterruptedError


class Interruption:
    """Takes the signals while its ``with`` body runs; a closed terminal (SIGHUP) counts too, unless ignored.

    Signals reach the main thread only; in any other thread nothing is taken.
    """

    def __init__(self) -> None:
        self._number: int | None = None
        self._before: dict[int, Any] = {}

    def check(self) -> None:
        """Do nothing, unless a signal has come.

        Raises:
            RunInterruptedError: If one has.
        """
        if self._number is not None:
            raise RunInterruptedError(self._number, signal.Signals(self._number).name)

    def __enter__(self) -> Self:
        """Take the signals."""
        if _in_main_thread():
            for number in _numbers():
                self._before[number] = signal.signal(number, self._handle)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give them back to whoever had them."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        del frame
        if self._number is None:
            self._number = number
        elif number == signal.SIGINT:
            raise KeyboardInterrupt
        else:
            raise SystemExit(128 + number)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _numbers() -> list[int]:
    numbers: list[int] = [signal.SIGINT, signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    return numbers


@contextmanager
def signals_exit() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the process in the ``with`` body, while there is nothing to be made safe.

    No exception is raised for it: the body compiles kernels, and unwinding the compiler half way through makes
    it crash or drop the exception.
    """

    def leave(number: int, frame: FrameType | None) -> NoReturn:
        del frame
        try:
            if sys.stderr is not None:
                print(f"stopped by {signal.Signals(number).name}", file=sys.stderr, flush=True)
        finally:  # also if nobody takes the message
            os._exit(128 + number)

    numbers = (signal.SIGINT, signal.SIGTERM) if _in_main_thread() else ()
    before = {number: signal.signal(number, leave) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
