"""Damaged NatNet packets: what they cost, and that nothing but a malformed-packet error ever comes of them.

    python benchmarks/natnet_fuzz.py [--packets 120000] [--seed 0]

Frames, definitions, server infos, echoes and responses of all versions are cut off, lengthened, flipped and given
wrong counts; each goes to its decoder and through a whole session. Ends with 1 if anything else came.
"""

from __future__ import annotations

import argparse
import collections
import random
import resource
import struct
import sys
import time
import tracemalloc

import numpy as np
from rich.console import Console
from rich.table import Table

from tcr_hardware.emulators import motive_encoder as encoder
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import TrackedMarkers
from tcr_hardware.natnet.errors import MalformedPacketError
from tcr_hardware.natnet.frame_decoder import decode_frame
from tcr_hardware.natnet.model_decoder import decode_models
from tcr_hardware.natnet.protocol import ServerInfo, Version
from tcr_hardware.natnet.session import Session
from tcr_hardware.natnet.settings import NatNetSettings

VERSIONS = ((2, 5), (2, 6), (2, 7), (2, 9), (3, 0), (4, 0), (4, 1), (4, 2), (4, 3))
COUNTS = (-1, -(2**31), 2**31 - 1, 2**16, 1_000, 1_001, 5_461, 255)


def samples() -> list[tuple[Version, int, bytes]]:
    """Return good packets: version, message, payload."""
    names = [f"b{k % 6}.n{k // 6}" for k in range(50)]
    positions = np.random.default_rng(0).normal(size=(50, 3))
    tracked = TrackedMarkers(names, positions)
    unnamed = MotiveFaults(unlabelled=True)
    found = []
    for version in VERSIONS:
        stamp = encoder.Stamp(1, 0.5, 1, 2, 3, 1e-3, 0)
        views = [tracked.view(positions, faults) for faults in (MotiveFaults(), unnamed)]
        found += [(Version(*version), 7, encoder.frame(version, stamp, tracked, view)) for view in views]
        found.append((Version(*version), 5, encoder.models(version, tracked)))
        info = encoder.server_info("Motive", version, 10_000_000, 1511, False, "239.255.42.99")
        found.append((Version(*version), 1, info))
    found.append((Version(4, 1), 13, struct.pack("<QQ", 1, 2)))
    found.append((Version(4, 1), 3, b"Bitstream,4.1\0"))
    return found


def mutated(payload: bytes, rng: random.Random) -> bytes:
    """Return a damaged copy."""
    out = bytearray(payload)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(out)) if out else 0
        match rng.randrange(6):
            case 0:
                del out[at:]
            case 1:
                out[at : at + 1] = bytes([rng.randrange(256)])
            case 2 if out:
                out[at] ^= 1 << rng.randrange(8)
            case 3:
                out[at : at + 4] = struct.pack("<i", rng.choice(COUNTS))
            case 4:
                out[at:at] = rng.randbytes(rng.randint(1, 40))
            case 5:
                out += rng.randbytes(1) * rng.randrange(60_000)
    return bytes(out[:65_503])


def decode(version: Version, message: int, payload: bytes) -> None:
    """Give a payload to its decoder."""
    if message == 7:
        decode_frame(payload, version)
    elif message == 5:
        decode_models(payload, version)
    elif message == 1:
        ServerInfo.decode(payload)


def outcome_of(version: Version, message: int, payload: bytes) -> tuple[str, float]:
    """Decode a payload; return what became of it, and the processor time [s]."""
    start = time.thread_time()
    try:
        decode(version, message, payload)
        outcome = "read"
    except MalformedPacketError:
        outcome = "refused"
    except Exception as error:
        outcome = repr(error)
    return outcome, time.thread_time() - start


def attack(packets: int, seed: int) -> tuple[collections.Counter[str], float, int]:
    """Return outcomes, worst time [s], and, while memory is traced, the largest allocation of a decoder [byte]."""
    rng, good, sessions = random.Random(seed), samples(), {}
    outcomes: collections.Counter[str] = collections.Counter()
    worst, largest = 0.0, 0
    for k in range(packets):
        version, message, payload = rng.choice(good)
        broken = mutated(payload, rng)
        if tracemalloc.is_tracing():
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            outcome, _ = outcome_of(version, message, broken)
            largest = max(largest, tracemalloc.get_traced_memory()[1] - before)
        else:
            outcome, seconds = outcome_of(version, message, broken)
            if seconds > worst:  # the least of five: a collection of garbage is not the packet's fault
                worst = max(worst, min(outcome_of(version, message, broken)[1] for _ in range(5)))
        outcomes[outcome] += 1
        session = sessions.get(version)
        if session is None or session.failure is not None:
            session = sessions[version] = Session(NatNetSettings(multicast=True), 0.0)
            info = encoder.server_info("Motive", version, 10_000_000, 1511, True, "239.255.42.99")
            session.receive(encoder.packet(1, info), 0.0)
        session.receive(struct.pack("<HH", message, len(broken)) + broken, 1e-3 * k)
        session.due(1e-3 * k)
    return outcomes, worst, largest


def main() -> int:
    """Attack and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--packets", type=int, default=120_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    start, third = time.perf_counter(), options.packets // 3
    first, worst, _ = attack(third, options.seed)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    second, later, _ = attack(third, options.seed + 1)
    growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    tracemalloc.start()
    traced, _, largest = attack(options.packets - 2 * third, options.seed + 2)
    seconds = time.perf_counter() - start
    outcomes, worst = first + second + traced, max(worst, later)
    table = Table("what", "value", title=f"{options.packets} damaged packets in {seconds:.0f} s")
    for name, count in outcomes.most_common():
        table.add_row(name, str(count))
    table.add_row("worst time of a decoder", f"{1e3 * worst:.2f} ms CPU")
    table.add_row("largest allocation of a decoder", f"{largest / 1e3:.0f} kB")
    table.add_row("growth of the process in the second third", f"{growth} kB")
    Console().print(table)
    return int(bool(set(outcomes) - {"read", "refused"}) or worst > 0.010 or largest > 1_000_000)


if __name__ == "__main__":
    sys.exit(main())
