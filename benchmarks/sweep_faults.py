"""Is a study that is killed again and again the study that nobody disturbed?

    python benchmarks/sweep_faults.py [--kills 10] [--runs 30] [--dask] [--jobs 2]

A study of short runs (a letter of some millimetres on a coarse plant) is run undisturbed with one process; then
again, while the study itself and one of its workers, in turn, are killed with -9 at random moments, and started
again until it ends by itself. With --dask the scheduler is a part of the study's process and dies with it. Ends
with 1 if the tables differ or a run was done twice.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
QUICK = (
    "trajectory.strokes=[{line: [[-4, 0], [4, 0]]}]", "trajectory.plane.offset_mm=[0, 0, 6]",
    "trajectory.dwell_s=0", "trajectory.lead_in_s=0.2", "trajectory.settle_s=0.2", "plant.step_ms=5.0",
)  # fmt: skip
ROWS, TABLE = "letter_t.study/rows.jsonl", "letter_t.study/table.csv"


def command(out: Path, runs: int, *more: str) -> list[str]:
    sets = [part for text in QUICK for part in ("--set", text)]
    study = ["sweep", "letter_t", "--seeds", f"0..{runs - 1}", "--out", str(out), "--logs", "none", "--quiet"]
    return [sys.executable, "-m", "tcrctl.cli.app", *study, *sets, *more]


def workers(parent: int) -> list[int]:
    """Return the processes below a process that were spawned as workers, at any depth."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            above = int(path.read_text().rpartition(")")[2].split()[1])
            words = (path.parent / "cmdline").read_text()
        except (OSError, ValueError):
            continue
        if above == parent and "spawn_main" in words:
            pid = int(path.parent.name)
            found += [pid, *workers(pid)]
    return found


def begin(out: Path, runs: int, more: tuple[str, ...]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command(out, runs, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--dask", action="store_true")
    told = parser.parse_args()
    os.environ["PYTHONPATH"] = f"{ROOT}:{ROOT / 'hardware'}"
    engine = ("--jobs", str(told.jobs), *(("--dask", "local") if told.dask else ()))
    dice = random.Random(told.kills)
    kills = []
    starts = 0
    with tempfile.TemporaryDirectory() as folder:
        quiet, loud = Path(folder) / "quiet", Path(folder) / "loud"
        subprocess.run(command(quiet, told.runs, "--jobs", "1"), check=True, stdout=subprocess.DEVNULL)
        rows, code = loud / ROWS, None
        while code != 0:
            study, starts = begin(loud, told.runs, engine), starts + 1
            while study.poll() is None and len(kills) < told.kills:
                before = rows.stat().st_size if rows.exists() else 0
                while study.poll() is None and (not rows.exists() or rows.stat().st_size == before):
                    time.sleep(0.01)
                time.sleep(dice.uniform(0.0, 1.0))
                below = workers(study.pid)
                victim = study.pid if len(kills) % 2 == 0 or not below else dice.choice(below)
                if study.poll() is None:
                    os.kill(victim, signal.SIGKILL)
                    kills.append("study" if victim == study.pid else "worker")
                if victim == study.pid:
                    break
            code = study.wait()
        same = (quiet / TABLE).read_bytes() == (loud / TABLE).read_bytes()
        addresses = [json.loads(line)["address"] for line in rows.read_text().splitlines()]
    print(f"{told.runs} runs, engine {' '.join(engine)}; killed {len(kills)} times: {', '.join(kills)}")
    print(f"started {starts} times; rows written {len(addresses)}, of different runs {len(set(addresses))}")
    print(f"table: {'the same, byte for byte' if same else 'DIFFERENT'}")
    return 0 if same and len(addresses) == len(set(addresses)) == told.runs else 1


if __name__ == "__main__":
    sys.exit(main())
