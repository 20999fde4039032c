"""The log as the control loop sees it: hand over a record, never wait for a disk.

control thread -- step(record) --> queue --> writer thread: encode, compress, flush --> file

Only the writer thread touches the file once the constructor has returned.

Two threads of a Python program hinder each other while both have something to do. A paced run has gaps between its
steps, in which the log is written. A run that no clock paces has none; there they take turns: the steps wait in the
queue until there are some dozens, then the control thread waits until all are written.
"""

from __future__ import annotations

import math
import os
import shlex
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import BinaryIO, Final, Self

from tcrctl.errors import LogError
from tcrctl.log.event import Event
from tcrctl.log.mcap_file import McapFile, Opening, Tap
from tcrctl.log.whereabouts import displaced
from tcrctl.signals import StepRecord

_QUEUE_S: Final = 2.0  # a writer that lags further behind will not catch up: the disk is too slow
_QUEUE_MIN_STEPS: Final = 1000
_TURN_STEPS: Final = 64  # most steps of an unpaced run between two turns of the writer thread
_POLL_S: Final = 1.0  # how often an idle writer looks whether the main thread still lives


def open_new(path: Path) -> BinaryIO:
    """Open a file for writing that must not exist yet."""
    return open(path, "xb")


@dataclass(frozen=True, slots=True)
class Flushing:
    """How often what is logged reaches the disk: at the earlier of the two intervals.

    Attributes:
        flush_s: A step is flushed at most this long after it was logged [s]; in a run that no clock paces, this
            much of the run's own time counts if it takes longer.
        flush_steps: At most this many steps are unflushed.
        fsync: Also wait at every flush until the disk has it (survives a power cut).
    """

    flush_s: float = 0.5
    flush_steps: int = 500
    fsync: bool = False


class LogWriter:
    """Writes one log; a context manager.

    The file is created, and its attachments and start metadata written, before the constructor returns: a bad
    folder is found before the robot moves. From then on a writer thread owns the file. Whatever ends the
    ``with`` body, the file gets a stop record, even if the disk is full; without one (kill -9, power cut) it is
    readable up to the last flush.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        opening: Opening,
        flushing: Flushing = Flushing(),
        *,
        wait_when_full: bool = False,
        tap: Tap | None = None,
        opener: Callable[[Path], BinaryIO] = open_new,
    ) -> None:
        """Create the log.

        Args:
            path: File to create; it must not exist.
            opening: What is written before the first step.
            flushing: How often what is written reaches the disk.
            wait_when_full: Let :meth:`step` wait for the writer thread from time to time, instead of failing when
                it lags; for runs that no clock paces.
            tap: Takes every message when it has been written, in the writer thread; it must neither wait nor raise.
            opener: Opens the file.

        Raises:
            LogError: If the file cannot be created; nothing is left behind.
        """
        self.path = Path(path)
        self._flushing, period_s = flushing, opening.period_s
        self._wait_when_full = wait_when_full
        self._least, self._turn_steps = 1, 0
        if wait_when_full:  # on a slow machine too a chunk shall be worth compressing
            self._least = max(1, math.ceil(flushing.flush_s / period_s - 1e-9))
            self._turn_steps = max(1, min(_TURN_STEPS, flushing.flush_steps // 2))
        self._limit = max(_QUEUE_MIN_STEPS, math.ceil(_QUEUE_S / period_s))
        self._queue: SimpleQueue[StepRecord | Event | dict[str, str]] = SimpleQueue()
        self._turn, self._written = threading.Event(), threading.Event()
        self._in_turn, self._event_t = 0, 0.0
        self._failure: Exception | None = None
        self._displaced = ""
        self._finished = self._reported = False
        self._stream = _create(self.path, opener)
        try:
            self._file = McapFile(self._stream, opening)
        except Exception as error:
            with suppress(OSError):
                self._stream.close()
            self.path.unlink(missing_ok=True)
            raise LogError(self.path, f"cannot be written: {error}") from error
        self._file.tap = tap
        self._thread = threading.Thread(target=self._run, name="tcrctl-log", daemon=False)
        self._thread.start()

    def step(self, record: StepRecord) -> None:
        """Log a step: puts the record in a queue and returns. The arrays must not be changed afterwards.

        Raises:
            LogError: If the writer thread failed (disk full), is too slow, or the log is finished.
        """
        self._check()
        if self._queue.qsize() >= self._limit and not self._wait_when_full:
            text = f"the disk is too slow: {self._limit} steps are waiting to be written"
            raise LogError(self.path, text, hint="Log to a faster disk or lower the control rate.")
        self._queue.put(record)
        self._in_turn += 1
        if self._wait_when_full and self._in_turn >= self._turn_steps:
            self._let_write()

    def event(self, t: float, kind: str, level: str, message: str) -> None:
        """Log an event at time ``t`` [s], or at that of the event before if it was later: they are in order.

        See :class:`tcrctl.log.event.Event`.

        Raises:
            LogError: As :meth:`step`.
            ValueError: If the level is unknown.
        """
        self._check()
        made = Event(t, kind, level, message)
        self._event_t = max(self._event_t, made.t)
        self._queue.put(replace(made, t=self._event_t))

    def finish(self, stop: Mapping[str, str]) -> None:
        """Write everything logged so far and metadata ``tcrctl.run.stop``, and close the file.

        Raises:
            LogError: If something of it could not be written; what was flushed stays readable. Also if the path
                does not lead to the file any more.
        """
        self._check()
        self._finished = True
        self._queue.put(dict(stop))
        self._turn.set()
        self._thread.join()
        if self._failure is not None:
            raise self._error(self._failure) from self._failure
        if self._displaced:
            raise LogError(self.path, f"is not there any more: {self._displaced}")

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the log with status ``error`` or ``aborted``, if it was not finished and has not failed."""
        if self._finished or self._reported:
            self._thread.join()
            return
        if error is None:
            self.finish({"status": "error", "reason": "the run ended without a result"})
            return
        status = "error" if isinstance(error, Exception) else "aborted"
        try:
            self.finish({"status": status, "reason": f"{type(error).__name__}: {error}"})
        except LogError as failure:
            if not isinstance(error, LogError):
                error.add_note(f"the log could not be finished: {failure}")

    def _check(self) -> None:
        if self._failure is not None:
            self._reported = True
            raise self._error(self._failure) from self._failure
        if self._finished:
            raise LogError(self.path, "is finished; nothing can be added")

    def _error(self, failure: Exception) -> LogError:
        hint = f"Everything up to the last flush is readable: tcrctl recover {shlex.quote(str(self.path))}"
        return LogError(self.path, f"writing failed: {failure}", hint=hint)

    def _let_write(self) -> None:
        """Give the writer thread its turn, and wait until it has written everything."""
        self._in_turn = 0
        self._written.clear()
        self._turn.set()
        while not self._written.wait(_POLL_S) and self._thread.is_alive():
            pass
        self._check()

    def _run(self) -> None:
        """Run the writer thread."""
        try:
            self._write_until_stop()
        except Exception as failure:
            self._end_after(failure)
            self._failure = failure
        self._displaced = displaced(self._stream, self.path)
        try:
            self._stream.close()
        except OSError as failure:
            self._failure = self._failure or failure
        self._written.set()

    def _end_after(self, failure: Exception) -> None:
        """Say in the file why it ends; what was flushed stays readable even if that fails too."""
        stop = {"status": "error", "reason": f"writing failed: {failure}"}
        with suppress(Exception):
            if isinstance(failure, OSError):
                self._file.cut_short(self.path, stop)
            else:
                self._file.finish(stop)

    def _write_until_stop(self) -> None:
        flush_at = math.inf
        while True:
            item = self._next(flush_at)
            if isinstance(item, dict):
                self._file.finish(item)
                if self._flushing.fsync:
                    os.fsync(self._stream.fileno())
                return
            if isinstance(item, StepRecord):
                self._file.step(item)
            elif isinstance(item, Event):
                self._file.event(item)
            flush_at = self._flush_if_due(flush_at)

    def _next(self, flush_at: float) -> StepRecord | Event | dict[str, str] | None:
        """Return the next item; None if a flush is due or nothing came for a while."""
        with suppress(Empty):
            return self._queue.get_nowait()
        self._written.set()
        if self._wait_when_full:  # what is logged outside a turn waits half a flush interval at most
            self._turn.wait(min(_POLL_S, 0.5 * self._flushing.flush_s))
            self._turn.clear()
        else:
            wait = max(0.0, min(_POLL_S, flush_at - time.monotonic()))
            with suppress(Empty):
                return self._queue.get(timeout=wait) if wait > 0.0 else None
        if not self._finished and not threading.main_thread().is_alive():
            return {"status": "error", "reason": "the program ended without finishing the log"}
        return None

    def _flush_if_due(self, flush_at: float) -> float:
        """Flush if it is time to; return when the next flush is due on the monotonic clock [s]."""
        if self._file.unflushed == 0:
            return math.inf
        now, waiting = time.monotonic(), self._file.unflushed
        room = max(1, self._flushing.flush_steps - self._turn_steps)  # so many may wait for the next turn
        if waiting >= room or (now >= flush_at and waiting >= self._least):
            self._file.flush(to_disk=self._flushing.fsync)
            return math.inf
        return min(flush_at, now + (0.5 if self._wait_when_full else 1.0) * self._flushing.flush_s)


def _create(path: Path, opener: Callable[[Path], BinaryIO]) -> BinaryIO:
    try:
        return opener(path)
    except FileExistsError as error:
        raise LogError(path, "exists already; a log is never overwritten") from error
    except OSError as error:
        text = f"cannot be created: {error.strerror or error}"
        raise LogError(path, text, hint=f"Is {path.parent} a folder you may write to?") from error
