"""What starting costs: the first run, which compiles kernels, later ones, and the help.

    python benchmarks/cold_start.py [--repeats 3] [--before FOLDER] [--first letter_t] [--warm cone_frustum]

Every number is the median over processes of their own, alternating with those of another checkout if there is one.
CPU is that of a process and of all that it started. The first run gets an empty folder for kernels every time.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parents[1]
PROGRAM = "import sys; from tcrctl.cli.app import main; sys.exit(main())"
#: The help is so short that it is asked for so often.
HELPS = 10


def measured(folder: Path, cache: str, *arguments: str) -> tuple[float, float]:
    """Run the program of a checkout; return wall time and CPU [s]."""
    places = {
        "PYTHONPATH": os.pathsep.join((str(folder), str(folder / "hardware"))),
        "NUMBA_CACHE_DIR": cache,
    }
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | places
    begin, before = time.perf_counter(), _children()
    subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        env=environment,
        capture_output=True,
        check=True,
        cwd=cache,
    )
    return time.perf_counter() - begin, _children() - before


def _children() -> float:
    """CPU of all processes that were waited for, and of those that they waited for [s]."""
    times = os.times()
    return times.children_user + times.children_system


def once(folder: Path, first: str, warm: str) -> Iterator[tuple[str, float]]:
    """Yield name and value [s] of every row, measured once."""
    with tempfile.TemporaryDirectory() as cache:
        measured(folder, cache, "--help")
        wall, cpu = measured(folder, cache, "run", first, "--out", cache)
        yield f"cold first `run {first}`, wall", wall
        yield "the same, CPU of all processes", cpu
        _, again = measured(folder, cache, "run", first, "--out", cache)
        yield "of that for compiling, CPU", cpu - again
        measured(folder, cache, "run", warm, "--out", cache)
        yield f"warm `run {warm}`, CPU", measured(folder, cache, "run", warm, "--out", cache)[1]
        yield "`tcrctl --help`, wall", median(measured(folder, cache, "--help")[0] for _ in range(HELPS))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--before", type=Path, help="another checkout of the program")
    parser.add_argument("--first", default="letter_t")
    parser.add_argument("--warm", default="cone_frustum")
    given = parser.parse_args()
    folders = {"before": given.before.absolute()} if given.before else {}
    folders["now"] = HERE
    found: dict[str, dict[str, list[float]]] = {name: {} for name in folders}
    for _ in range(given.repeats):
        for name, folder in folders.items():
            for row, value in once(folder, given.first, given.warm):
                found[name].setdefault(row, []).append(value)
    Console().print(table(found))


def table(found: dict[str, dict[str, list[float]]]) -> Table:
    """Return the medians, and their ratio if there are two checkouts."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    shown = Table(title=f"starting, on {count} cores [s]")
    shown.add_column("what")
    for name in (*found, *(["ratio"] if len(found) > 1 else [])):
        shown.add_column(name, justify="right")
    for row in found["now"]:
        values = [median(rows[row]) for rows in found.values()]
        ratio = [f"{values[1] / values[0]:.2f}"] if len(values) > 1 else []
        shown.add_row(row, *(f"{value:.2f}" for value in values), *ratio)
    return shown


if __name__ == "__main__":
    main()
