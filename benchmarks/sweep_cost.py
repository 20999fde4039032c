"""What a study costs, and beyond its runs, what a second process is worth, and how its memory grows.

    taskset -c 0,1 python benchmarks/sweep_cost.py [--runs 20] [--spec letter_t] [--set plant.step_ms=auto]

On an otherwise idle computer. Overhead is wall time with one process, less start-up, over the sum of the runs' own
seconds; speed-up is the ratio of the wall times of two and one processes.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.setdefault("NUMBA_OPT", "1")

from tcrctl.executors.engine import Engine
from tcrctl.study.command_line import told_study
from tcrctl.study.plan import planned
from tcrctl.study.sweep import sweep


def memory_mb() -> float:
    """Return the memory of this process."""
    status = Path("/proc/self/status").read_text()
    return float(status.partition("VmRSS:")[2].split()[0]) / 1e3


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--spec", default="letter_t")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    told = parser.parse_args()
    study = told_study(told.spec, told.set, {"seeds": f"0..{told.runs - 1}"})
    runs, walls = planned(study), {}
    for jobs in (1, 2):
        marks, memory = [time.perf_counter()], [memory_mb()]

        def tell(*_: object, marks: list[float] = marks, memory: list[float] = memory) -> None:
            marks.append(time.perf_counter())
            memory.append(memory_mb())

        with tempfile.TemporaryDirectory() as folder:
            done = sweep(study, runs, engine=Engine(jobs), out=Path(folder), logs="none", told=tell)
        rows = [row for row in done.rows if row is not None]
        walls[jobs] = marks[-1] - marks[jobs]  # what the first ones took holds loading and warming up
        own = sum(row.seconds for row in rows[jobs:]) / jobs
        print(
            f"{jobs} processes: {len(rows)} runs, {walls[jobs]:.1f} s after the first {jobs}, of which the runs "
            f"themselves {own:.1f} s: overhead {100 * (walls[jobs] / own - 1):.1f} %; memory of the study "
            f"{memory[0]:.0f} -> {memory[len(memory) // 2]:.0f} -> {memory[-1]:.0f} MB",
            flush=True,
        )
    per_run = walls[1] / (told.runs - 1), walls[2] / (told.runs - 2)
    print(f"runs a minute and core: {60.0 / per_run[0]:.1f}")
    print(f"speed-up of two processes over one: {per_run[0] / per_run[1]:.2f}")


if __name__ == "__main__":
    main()
