"""What a live view costs the control loop: time in the control thread, with and without viewers.

    python benchmarks/view_cost.py [--seconds 5]

A paced loop hands the steps of a 13-module, six-cable robot to the log, as a run does; the log's own thread passes
its messages on to the view. ``late`` is how late the loop woke up: what the threads took from it through the
interpreter, the client's own thread among them. Needs pip install -e '.[test]'.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support import records
from support.viewer_client import ViewerClient
from tcrctl.log.mcap_file import Opening
from tcrctl.log.viewer_topics import TOPICS
from tcrctl.log.writer import LogWriter
from tcrctl.view.live import LiveView

N_MODULES, N_CABLES, N_RECORDS = 13, 6, 400


def paced_run(rate_hz: float, seconds: float, view: LiveView | None) -> tuple[list[float], list[float]]:
    """Log a run; return the cost of every ``step`` call and the lateness of every step [us]."""
    period = 1.0 / rate_hz
    pool = [records.record(k, N_MODULES, N_CABLES, period=period) for k in range(N_RECORDS)]
    cost, late = [], []
    with tempfile.TemporaryDirectory() as folder:
        log = LogWriter(
            Path(folder) / "log.mcap",
            Opening(
                attachments=records.ATTACHMENTS,
                start=records.START,
                geometry=records.geometry(N_MODULES, N_CABLES),
                epoch_ns=time.time_ns(),
                period_s=period,
            ),
            tap=None if view is None else view.tap,
        )
        with log:
            begin = time.perf_counter()
            for k in range(int(rate_hz * seconds)):
                record = dataclasses.replace(pool[k % N_RECORDS], k=k, t=k * period)
                time.sleep(max(0.0, begin + k * period - time.perf_counter()))
                woken = time.perf_counter()
                log.step(record)
                cost.append(1e6 * (time.perf_counter() - woken))
                late.append(1e6 * max(0.0, woken - begin - k * period))
            log.finish({"status": "success"})
    return cost, late


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    head = "".join(f"{name:>12}" for name in ("p50 us", "p99 us", "max us", "late p50", "late p99"))
    print(f"{'case':36}{head}")
    for rate in (20.0, 100.0, 1000.0):
        for viewers in (None, 0, 1):
            with ExitStack() as stack:
                view = None if viewers is None else stack.enter_context(LiveView("benchmark", port=0))
                if view is not None and viewers:
                    client = stack.enter_context(ViewerClient(view.url))
                    client.subscribe(count=len(TOPICS) + 2)
                    view.wait_for_viewer(10.0)
                cost, late = paced_run(rate, seconds, view)
            name = "no view" if viewers is None else f"view, {viewers} clients"
            numbers = [*np.quantile(cost, [0.5, 0.99, 1.0]), *np.quantile(late, [0.5, 0.99])]
            print(f"{f'{rate:.0f} Hz, {name}':36}" + "".join(f"{number:12.1f}" for number in numbers))


if __name__ == "__main__":
    main()
