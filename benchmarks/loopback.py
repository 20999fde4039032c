"""Experiments on the emulated bench against the same on the simulated plant: errors, and camera-to-drive latency.

    python benchmarks/loopback.py                # letter_t, fixed_point_rotation at 20 and 100 Hz, 8 minutes
    python benchmarks/loopback.py letter_t 100   # one experiment, one rate
    python benchmarks/loopback.py --rig dynamixel_loopback letter_t 20
    python benchmarks/loopback.py --busy 1 letter_t 100  # beside a process that only computes
    chrt -f 10 python benchmarks/loopback.py     # on a computer that is busy, where real-time priority is allowed

Needs a computer that is not busy: cameras, PLCs, two robots and the controller share it, in real time. On a bench
the error is that of the estimate, as nobody knows more.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

TCRCTL = [sys.executable, "-m", "tcrctl.cli.app"]
RIG = ["--set", "plant.kind=rig", "--yes"]
ERROR_FACTOR, P50_MS, P99_MS = 2.0, 4.0, 20.0


def run(name: str, rate: float, out: str, *options: str) -> dict[str, Any]:
    """Run an experiment; return its result."""
    period = ["--set", f"controller.period_s={1.0 / rate:g}", "--out", out, "--json", "--quiet"]
    done = subprocess.run(
        [*TCRCTL, "run", name, *period, *options], capture_output=True, text=True, check=False
    )
    result: dict[str, Any] = json.loads(done.stdout)
    return {**result, "exit_code": done.returncode}


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiment", nargs="?", help="default: letter_t and fixed_point_rotation")
    parser.add_argument("rates", nargs="*", type=float, help="control steps per second (default 20 and 100)")
    parser.add_argument("--rig", default="loopback", help="rig file that is emulated")
    parser.add_argument("--busy", type=int, default=0, help="processes beside it that only compute")
    return parser.parse_args()


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Let so many processes compute."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def main(given: argparse.Namespace) -> int:
    """Print the table; return how many rows are not as they must be."""
    rig, bad = given.rig, 0
    names = [given.experiment] if given.experiment else ["letter_t", "fixed_point_rotation"]
    rates = given.rates or [20.0, 100.0]
    print(
        "| experiment | rate | exit | max error, bench | max error, simulated | latency p50 | p99 | overruns | ok |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as out:
        emulator = subprocess.Popen([*TCRCTL, "emulate", rig], stderr=subprocess.PIPE, text=True)
        try:
            for line in emulator.stderr or ():
                if "is emulated" in line:
                    break
                print(line, end="", file=sys.stderr)
            else:
                return 1
            for name in names:
                for rate in rates:
                    with busy(given.busy):
                        bench = run(name, rate, out, *RIG, "--set", f"plant.rig={rig}")
                    bad += not _row(name, rate, bench, run(name, rate, out))
        finally:
            emulator.terminate()
            emulator.wait()
    return bad


def _row(name: str, rate: float, bench: dict[str, Any], simulated: dict[str, Any]) -> bool:
    if bench["exit_code"] or bench["latency_ms"] is None:
        print(f"| {name} | {rate:g} Hz | {bench['exit_code']} | {bench['reason']} | | | | | **no** |")
        return False
    error, wanted = (each["position_error_mm"]["max"] for each in (bench, simulated))
    p50, p99 = bench["latency_ms"]["p50"], bench["latency_ms"]["p99"]
    good = error <= ERROR_FACTOR * wanted and p50 <= P50_MS and p99 <= P99_MS
    print(
        f"| {name} | {rate:g} Hz | 0 | {error:.2f} mm | {wanted:.2f} mm | {p50:.1f} ms | {p99:.1f} ms "
        f"| {bench['overruns']} of {bench['steps']} | {'yes' if good else '**no**'} |",
        flush=True,
    )
    return bool(good)


if __name__ == "__main__":
    sys.exit(main(arguments()) > 0)
