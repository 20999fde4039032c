"""What a task costs on the Dask seam, and what the scheduler keeps of it: many trivial tasks.

    python benchmarks/cluster_tasks.py [--tasks 100000] [--jobs 2]

Everything is handed out at a time first, as a user of Dask would, then through ``tcrctl.executors.outcomes``, which
keeps two per worker in the air.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import psutil
from distributed import Client, LocalCluster

from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import outcomes


def nothing(i: int) -> int:
    return i


def memory_mb() -> float:
    """Return the memory of this process, in which client and scheduler are."""
    return float(psutil.Process().memory_info().rss) / 1e6


def at_once(tasks: int, jobs: int) -> tuple[float, float]:
    """Return milliseconds per task, and megabytes that client and scheduler grow by."""
    cluster: Any = LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address=None)
    with cluster, Client(cluster) as client, client.get_executor(pure=False) as executor:
        executor.submit(nothing, 0).result()
        before, begin = memory_mb(), time.perf_counter()
        waiting = [executor.submit(nothing, i) for i in range(tasks)]
        most = memory_mb()
        for future in waiting:
            future.result()
        return 1e3 * (time.perf_counter() - begin) / tasks, max(most, memory_mb()) - before


def as_they_come(tasks: int, jobs: int) -> tuple[float, float]:
    """Return the same through the seam."""
    most = 0.0
    before = 0.0
    begin = 0.0
    for done, _ in enumerate(outcomes(Engine(jobs, "local"), nothing, range(tasks + 1))):
        if done == 0:
            before, begin = memory_mb(), time.perf_counter()
        if done % 1000 == 0:
            most = max(most, memory_mb())
    return 1e3 * (time.perf_counter() - begin) / tasks, most - before


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", type=int, default=100_000)
    parser.add_argument("--jobs", type=int, default=2)
    told = parser.parse_args()
    for name, measure in (("as they come", as_they_come), ("all at once", at_once)):
        each, grown = measure(told.tasks, told.jobs)
        print(
            f"{told.tasks} tasks {name}, {told.jobs} workers: {each:.2f} ms each, {grown:.0f} MB more",
            flush=True,
        )


if __name__ == "__main__":
    main()
