"""Size and memory of a long run: ten minutes of pose control of tcr700 at 100 Hz.

    python benchmarks/log_size.py [--seconds 600] [--rate 100] [--realtime] [--replay]

Prints the size of the log, the memory of the process over time, and how long a control step took. Unpaced, ten
minutes take some minutes; with ``--realtime`` ten.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_OPT", "1")

from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.replay.replay import replay

#: Time of cone_frustum outside its turns, and of one turn [s].
REST_S, TURN_S = 30.0, 25.0


def resident_mb() -> float:
    """Return the memory of this process in RAM [MB]; Linux only."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument("--replay", action="store_true", help="replay the log afterwards")
    options = parser.parse_args()
    turns = max(0.5, (options.seconds - REST_S) / TURN_S)
    settings = [f"controller.period_s={1.0 / options.rate!r}", f"trajectory.turns={turns!r}"]
    experiment = prepare(load_spec("cone_frustum", settings))
    memory: list[tuple[int, float]] = []

    def watch(done: int, total: int) -> None:
        if done % (total // 10) == 1:
            memory.append((done, resident_mb()))

    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        summary = run_experiment(experiment, out=Path(folder), realtime=options.realtime, progress=watch)
        took, size, measures = time.perf_counter() - begin, summary.log.stat().st_size, summary.measures
        print(
            f"{measures.steps} steps, {measures.duration_s:.0f} s of robot time in {took:.0f} s: {summary.status}"
        )
        print(f"log: {size / 1e6:.1f} MB, {size / measures.steps:.0f} B per step")
        print(
            f"ten minutes at {options.rate:.0f} Hz: {600 * options.rate * size / measures.steps / 1e6:.1f} MB"
        )
        print(f"control step [ms]: {measures.control_ms}")
        print("memory [MB] at step: " + ", ".join(f"{k}: {mb:.0f}" for k, mb in memory))
        if options.replay:
            found = replay(summary.log)
            print(f"replay: {found.status}, {found.duration_s / found.seconds:.1f} times real time")
    sys.exit(summary.exit_code)


if __name__ == "__main__":
    main()
