"""Where work is done side by side: in processes of this computer, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tcrctl.executors.processes import process_workers
from tcrctl.executors.workers import Workers

#: ``--dask`` with this word starts workers on this computer.
LOCAL: Final = "local"
_SIBLINGS: Final = "/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list"


def available_cores() -> int:
    """Return the logical cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def physical_cores() -> int:
    """Return the physical cores among those: two threads of one core only wait for each other in this work."""
    if not hasattr(os, "sched_getaffinity"):
        return available_cores()
    try:
        return len({Path(_SIBLINGS.format(core)).read_text() for core in os.sched_getaffinity(0)})
    except OSError:
        return available_cores()


@dataclass(frozen=True, slots=True)
class Engine:
    """What is asked for on the command line.

    Attributes:
        jobs: Processes side by side, of this computer.
        dask: Address of a scheduler, or ``local``; None for plain processes.
    """

    jobs: int
    dask: str | None = None

    @contextmanager
    def open(self, warm: Callable[[], object] | None = None) -> Iterator[Workers]:
        """Start, and end whatever way the body ends.

        Args:
            warm: Is called once per computer before anything else, to compile kernels; must be picklable.

        Raises:
            InputError: If Dask is asked for and not installed.
            DeviceError: If there is no such scheduler.
        """
        if self.dask is None:
            opened = process_workers(self.jobs, warm)
        else:
            # an extra
            from tcrctl.executors.cluster import cluster_workers

            opened = cluster_workers(None if self.dask == LOCAL else self.dask, self.jobs, warm)
        with opened as workers:
            yield workers
