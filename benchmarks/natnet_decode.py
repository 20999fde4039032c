"""Cost of decoding one NatNet frame, version by version: 50 labelled markers in 6 rigid bodies.

    python benchmarks/natnet_decode.py [--repeat 2000]

Times are of this process only; the requirement is a median of at most 50 us.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from rich.console import Console
from rich.table import Table

from tcr_hardware.emulators import motive_encoder as encoder
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import TrackedMarkers
from tcr_hardware.markers import MarkerMap, NodeMarker
from tcr_hardware.natnet.frame_decoder import decode_frame
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.model_decoder import decode_models
from tcr_hardware.natnet.protocol import Version

VERSIONS = ("2.5", "2.7", "2.9", "3.0", "4.0", "4.1", "4.3")
NAMES = [f"b{k % 6}.n{k // 6}" for k in range(50)]


def timed(function, repeat: int) -> np.ndarray:
    """Return the durations of single calls [us]."""
    times = np.empty(repeat)
    for k in range(repeat):
        start = time.perf_counter()
        function()
        times[k] = time.perf_counter() - start
    return 1e6 * times


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    repeat = parser.add_argument("--repeat", type=int, default=2000) and parser.parse_args().repeat
    positions = np.random.default_rng(0).normal(size=(50, 3))
    tracked = TrackedMarkers(NAMES, positions)
    view = tracked.view(positions, MotiveFaults())
    markers = MarkerMap([NodeMarker(name, label=name) for name in NAMES], positions)
    table = Table(
        "version", "bytes", "decode p50 us", "p99 us", "+ marker map p50 us", title="one NatNet frame"
    )
    for text in VERSIONS:
        version = Version.parse(text)
        payload = encoder.frame(version, encoder.Stamp(1, 0.5, 1, 2, 3, 1e-3, 0), tracked, view)
        models = decode_models(encoder.models(version, tracked), version)

        def located(payload=payload, version=version, models=models) -> None:
            frame = MarkerFrame(1, 0, 0.0, 0.0, None, decode_frame(payload, version), models)
            assert markers.locate(frame).valid.all()

        decode = timed(lambda payload=payload, version=version: decode_frame(payload, version), repeat)
        both = timed(located, repeat // 4)
        p50, p99 = np.percentile(decode, [50, 99])
        table.add_row(text, str(len(payload)), f"{p50:.1f}", f"{p99:.1f}", f"{np.median(both):.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
