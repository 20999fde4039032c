"""Processes that compile kernels side by side; none outlives the call, and whatever they fail at is left out."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Final

from tcrctl.kernels.order import Order
from tcrctl.kernels.worker import DONE

#: Takes kernels done and in all, and the seconds that are left, None while that is unknown.
Watch = Callable[[int, int, float | None], None]

_SITE: Final = str(Path(__file__).parents[2])
#: The program is looked for where this one is, behind everything else, and not in the working directory.
_START: Final = f"import sys; sys.path.append({_SITE!r}); from tcrctl.kernels.worker import main; main()"
#: How often somebody is told how far it is [s].
_POLL_S: Final = 0.2
#: Time in which some kernel has to be done [s]: then something is wrong, and the run goes on without.
PATIENCE_S: Final = 300.0
#: Time for a process that has been told to end [s].
_GRACE_S: Final = 5.0


def command() -> list[str]:
    """Return what starts a worker."""
    return [sys.executable, "-P", "-c", _START]


class Crew:
    """Workers, and what they have done.

    Attributes:
        failed: Kernels that could not be compiled.
    """

    def __init__(self, order: Order, processes: int, start: Callable[[], list[str]] = command):
        """Take the tasks, and how many processes there may be; ``start`` returns the command of one."""
        self.failed = 0
        self._order, self._start, self._leaving = order, start, False
        self._changed = threading.Condition()
        self._processes: list[subprocess.Popen[str]] = []
        count = min(processes, len(order.tasks))
        self._threads = [threading.Thread(target=self._employ, daemon=True) for _ in range(count)]

    def work(self, watch: Watch) -> None:
        """Compile everything, or what is possible; ends all processes whatever way it ends.

        Args:
            watch: Is told several times a second how far it is.
        """
        begin = time.monotonic()
        try:
            for thread in self._threads:
                thread.start()
            with self._changed:
                while self._is_going_on(begin):
                    self._tell(watch, time.monotonic() - begin)
                    self._changed.wait(_POLL_S)
                self._tell(watch, time.monotonic() - begin)
        finally:
            self._leave()

    def _is_going_on(self, begin: float) -> bool:
        late = time.monotonic() - begin > PATIENCE_S * (1 + len(self._order.ended))
        return not late and not self._order.done and any(thread.is_alive() for thread in self._threads)

    def _tell(self, watch: Watch, elapsed: float) -> None:
        share = self._order.share
        left = elapsed * (1.0 - share) / share if share else None
        watch(len(self._order.ended), len(self._order.tasks), left)

    def _leave(self) -> None:
        """End the processes: their input is closed, which they obey within a moment."""
        with self._changed:
            self._leaving = True
            self._changed.notify_all()
            processes = list(self._processes)
        for process in processes:
            _close(process.stdin)
        for thread in self._threads:
            thread.join()

    def _employ(self) -> None:
        """Keep one process busy, in a thread of its own."""
        with self._changed:
            if self._leaving:
                return
            try:
                process = _started(self._start())
            except OSError:
                return
            self._processes.append(process)
        try:
            while (task := self._next()) is not None:
                answer = _asked(process, task)
                with self._changed:
                    self._order.ended.add(task)
                    self.failed += answer != DONE
                    self._changed.notify_all()
                if not answer:
                    return
        finally:
            _end(process)

    def _next(self) -> int | None:
        """Wait for a task; None if there will be none."""
        with self._changed:
            while not self._leaving and not self._order.done:
                task = self._order.take()
                if task is not None:
                    return task
                self._changed.wait(_POLL_S)
        return None


def _started(start: list[str]) -> subprocess.Popen[str]:
    pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
    return subprocess.Popen(start, stdin=pipe, stdout=pipe, stderr=nothing, text=True)


def _asked(process: subprocess.Popen[str], task: int) -> str:
    """Return what a process answers; nothing if it has ended."""
    if process.stdin is None or process.stdout is None:
        return ""
    try:
        print(task, file=process.stdin, flush=True)
        return process.stdout.readline().strip()
    except (OSError, ValueError):  # ended, or closed while we wait
        return ""


def _end(process: subprocess.Popen[str]) -> None:
    """Leave a process nothing to read, and wait until it has ended."""
    _close(process.stdin)
    try:
        process.wait(timeout=_GRACE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    _close(process.stdout)


def _close(stream: IO[str] | None) -> None:
    if stream is not None:
        with suppress(OSError, ValueError):  # there may be something in it that nobody takes any more
            stream.close()
