"""A minute of frames from the emulated Motive server, in a process of its own, to the client on 127.0.0.1.

    python benchmarks/natnet_loopback.py [--seconds 60] [--rate 240] [--multicast]

Reports lost frames and the time from sending to the frame being available. Ends with 1 if a frame was lost.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import sys
import time

import numpy as np
from rich.console import Console
from rich.table import Table

from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcr_hardware.natnet.client import NatNetClient
from tcr_hardware.natnet.settings import NatNetSettings

NAMES = [f"b{k % 13}.n{k // 13}" for k in range(50)]
LATENCY = 0.002


def serve(settings: MotiveSettings, ports, stop) -> None:
    """Run the server until told to stop."""
    positions = np.random.default_rng(0).normal(size=(50, 3))
    with MotiveEmulator(NAMES, lambda: positions, settings) as motive:
        ports.put(motive.address[1])
        stop.wait()


def receive(client: NatNetClient, seconds: float) -> list:
    """Return all frames of some seconds."""
    frames, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.5)
        frames += client.drain()
    return frames


def main() -> int:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=240.0)
    parser.add_argument("--multicast", action="store_true")
    options = parser.parse_args()
    settings = MotiveSettings(
        command_port=0, data_port=15211, rate_hz=options.rate, multicast=options.multicast, latency_s=LATENCY
    )
    context = multiprocessing.get_context("spawn")
    ports, stop = context.Queue(), context.Event()
    server = context.Process(target=serve, args=(settings, ports, stop))
    server.start()
    try:
        address = NatNetSettings(command_port=ports.get(), data_port=15211, multicast=options.multicast)
        with NatNetClient(address) as client:
            receive(client, 1.0)  # until the clocks are known
            frames, statistics = receive(client, options.seconds), client.statistics()
    finally:
        stop.set()
        server.join()
    late = 1e3 * np.array([frame.arrival - frame.exposure - LATENCY for frame in frames])
    p50, p99 = np.percentile(late, [50, 99])
    gaps = sum(b.number - a.number - 1 for a, b in itertools.pairwise(frames))
    table = Table("what", "value", title=f"{options.rate:g} Hz for {options.seconds:g} s")
    table.add_row("frames", str(len(frames)))
    table.add_row("lost", str(statistics.lost))
    table.add_row("gaps in the numbers drained", str(gaps))
    table.add_row(
        "malformed, late, repeated", f"{statistics.malformed}, {statistics.late}, {statistics.duplicates}"
    )
    table.add_row("planned sending to available", f"p50 {p50:.2f}, p99 {p99:.2f}, max {late.max():.2f} ms")
    table.add_row("clock known within", f"{1e3 * statistics.clock_uncertainty_s:.3f} ms")
    Console().print(table)
    return int(statistics.lost + gaps > 0)


if __name__ == "__main__":
    sys.exit(main())
