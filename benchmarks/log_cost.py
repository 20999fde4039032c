"""What logging costs: time in the control thread, size on disk.

    python benchmarks/log_cost.py [--seconds 5]

Steps are those of a 13-module, six-cable robot with full entropy in every digit, each with its state at 20 Hz and
with the state once a second at 1 kHz, as by default. ``full`` includes the simulated truth, ``rig`` does not; the
bytes of the viewer topics are the difference to a log without them.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support import records
from tcrctl.experiment.spec import LogSettings
from tcrctl.log.mcap_file import Opening
from tcrctl.log.viewer_topics import ViewerTopics
from tcrctl.log.writer import Flushing, LogWriter
from tcrctl.signals import StepRecord

N_MODULES, N_CABLES, N_RECORDS = 13, 6, 400


def make_records(period: float, truth: bool) -> list[StepRecord]:
    made = [records.record(k, N_MODULES, N_CABLES, period=period) for k in range(N_RECORDS)]
    return made if truth else [dataclasses.replace(record, truth=None) for record in made]


def log_run(rate_hz: float, seconds: float, truth: bool, paced: bool) -> tuple[list[float], float]:
    """Log a run; return the cost of every ``step`` call [us] and the bytes per step."""
    period = 1.0 / rate_hz
    pool, cost, count = make_records(period, truth), [], int(rate_hz * seconds)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        with LogWriter(
            path,
            Opening(
                attachments=records.ATTACHMENTS,
                start=records.START,
                geometry=records.geometry(N_MODULES, N_CABLES),
                epoch_ns=time.time_ns(),
                period_s=period,
                full_state_s=LogSettings().full_state(period),
            ),
            Flushing(flush_steps=500 if paced else max(1, int(0.5 * rate_hz))),
            wait_when_full=not paced,
        ) as log:
            empty = path.stat().st_size
            begin = time.perf_counter()
            for k in range(count):
                record = dataclasses.replace(pool[k % N_RECORDS], k=k, t=k * period)
                if paced:
                    time.sleep(max(0.0, begin + k * period - time.perf_counter()))
                before = time.perf_counter()
                log.step(record)
                cost.append(1e6 * (time.perf_counter() - before))
            log.finish({"status": "success"})
        return cost, (path.stat().st_size - empty) / count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    print(f"{'case':34} {'p50 us':>8} {'p99 us':>8} {'max us':>8}")
    for rate in (20.0, 1000.0):
        cost, _ = log_run(rate, seconds, truth=True, paced=True)
        p50, p99, most = np.quantile(cost, [0.5, 0.99, 1.0])
        print(f"{f'step() at {rate:.0f} Hz, paced':34} {p50:8.1f} {p99:8.1f} {most:8.1f}")
    print(f"\n{'case':34} {'B/step':>8} {'without viewer topics':>22}")
    with_viewer = ViewerTopics.messages
    for rate in (20.0, 1000.0):
        for name, truth in (("full", True), ("rig", False)):
            _, size = log_run(rate, 1000 / rate, truth, paced=False)
            ViewerTopics.messages = lambda *_: iter(())  # type: ignore[method-assign]
            _, bare = log_run(rate, 1000 / rate, truth, paced=False)
            ViewerTopics.messages = with_viewer  # type: ignore[method-assign]
            print(f"{f'{name} at {rate:.0f} Hz':34} {size:8.0f} {bare:22.0f}")


if __name__ == "__main__":
    main()
