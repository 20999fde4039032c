"""Jobs in processes of their own: some alone, the others side by side; stopped together."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.loop.interruption import Interruption
from tcrctl.paper.job import Job

#: No job of the table takes nearly as long [s].
TIME_LIMIT_S: Final = 900.0
#: Time that a stopped job has to finish its log before it is killed [s].
GRACE_S: Final = 15.0
_POLL_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Done:
    """What became of a job.

    Attributes:
        job: The job.
        result: The object that it printed; empty if it printed none.
        reason: Why there is nothing to be measured; empty if there is.
        seconds: Wall time [s].
        code: Exit code, as in :mod:`tcrctl.errors`.
    """

    job: Job
    result: Mapping[str, Any]
    reason: str
    seconds: float
    code: int = 0


class Processes:
    """Runs jobs; every process is the leader of its own session, so that Ctrl-C reaches only this one."""

    def __init__(self, folder: Path, workers: int) -> None:
        """Prepare.

        Args:
            folder: Where the jobs write.
            workers: How many run side by side.
        """
        self._folder, self._workers = folder, workers
        self._lock = threading.Lock()
        self._live = set[subprocess.Popen[str]]()
        self._stopped = threading.Event()

    def run(self, jobs: Sequence[Job], begun: Callable[[Job], None], ended: Callable[[Done], None]) -> None:
        """Run jobs, first those that need the machine for themselves, one by one.

        Args:
            jobs: What to run.
            begun: Is told when a job begins.
            ended: Is told what became of it; both are called in any thread.

        Raises:
            RunInterruptedError: If a signal came; running jobs were told to stop, and did or were killed.
        """
        alone = [job for job in jobs if job.alone]
        rest = [job for job in jobs if not job.alone]
        with Interruption() as interruption:
            for some, workers in ((alone, 1), (rest, self._workers)):
                with ThreadPoolExecutor(workers) as pool:
                    waiting = [pool.submit(self._run, job, begun, ended) for job in some]
                    try:
                        self._wait(waiting, interruption)
                    except BaseException:
                        for future in waiting:
                            future.cancel()
                        self._stop()
                        raise

    def _wait(self, waiting: Sequence[Future[None]], interruption: Interruption) -> None:
        left = set(waiting)
        while left:
            interruption.check()
            done, left = wait(left, timeout=_POLL_S, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()

    def _run(self, job: Job, begun: Callable[[Job], None], ended: Callable[[Done], None]) -> None:
        begin = time.monotonic()
        with self._lock:
            if self._stopped.is_set():
                return
            child = _start(job, self._folder)
            self._live.add(child)
        begun(job)
        try:
            printed, said = child.communicate(timeout=TIME_LIMIT_S)
            late = ""
        except subprocess.TimeoutExpired:
            child.kill()
            printed, said = child.communicate()
            late = f"took longer than {TIME_LIMIT_S:g} s"
        finally:
            with self._lock:
                self._live.discard(child)
        if self._stopped.is_set():  # what it did is in its log
            return
        result = _object(printed)
        reason = late or _failure(child.returncode, result, said)
        ended(Done(job, result, reason, time.monotonic() - begin, child.returncode))

    def _stop(self) -> None:
        """Ask every live process to stop, then make it."""
        with self._lock:
            self._stopped.set()
            live = list(self._live)
        for child in live:
            child.send_signal(signal.SIGINT)
        deadline = time.monotonic() + GRACE_S
        while any(child.poll() is None for child in live) and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        for child in live:
            if child.poll() is None:
                child.kill()


def _start(job: Job, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        job.command(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={"OPENBLAS_NUM_THREADS": "1", "NUMBA_OPT": "1", **os.environ},
    )


def _object(printed: str) -> Mapping[str, Any]:
    try:
        made = json.loads(printed)
    except ValueError:
        return {}
    return made if isinstance(made, dict) else {}


def _failure(code: int, result: Mapping[str, Any], said: str) -> str:
    """Say why a job that ended with an exit code has nothing to be measured; a missed criterion is no failure."""
    if code in (0, 3) and result:
        return ""
    last = said.strip().splitlines()[-1:] or ["it said nothing"]
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return str(result.get("reason") or f"exit code {code}: {last[0]}")
