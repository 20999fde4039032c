"""Latency of the exchange with an emulated PLC in another process, over TCP and over RTU on a pseudo-terminal.

    python benchmarks/plc_exchange.py [--seconds 5]

Also: how long a silent PLC goes unnoticed, and how long after ``kill -9`` of the host the drives stand still.
A pseudo-terminal has no baud rate; add the wire time of `tcr_hardware.modbus.wire_time` for a real line.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import time
from multiprocessing.connection import Connection

import numpy as np
from rich.console import Console
from rich.table import Table

from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.errors import LinkError, LinkTimeoutError
from tcr_hardware.modbus.registers import Control, Status
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink

ON = Control.ENABLE | Control.RUN
FOLLOW = ON | Control.FOLLOW
SPEED = 50_000


def serve(pipe: Connection) -> None:
    """Run the PLC; over the pipe come (name of a fault or "state" or "stop")."""
    with PlcEmulator() as plc:
        plc.start(rtu="pty")
        pipe.send((plc.address, plc.device))
        while (word := pipe.recv()) != "stop":
            if word == "state":
                pipe.send((plc.snapshot(), time.monotonic()))
            elif word == "clear":
                plc.faults.clear()
            else:
                plc.faults.set(word)


def paced(bus: PlcBus, hz: float, seconds: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Round trips and latenesses of the cycle starts [ms], and exchanges that failed."""
    round_trips, late, failed, start = [], [], 0, time.monotonic() + 0.05
    for k in range(round(hz * seconds)):
        deadline = start + k / hz
        time.sleep(max(deadline - time.monotonic(), 0.0))
        late.append(time.monotonic() - deadline)
        at = round(5_000 * np.sin(2 * np.pi * 0.2 * k / hz))
        try:
            round_trips.append(bus.exchange((at,) * 6, FOLLOW, SPEED).round_trip_s)
        except LinkError:
            failed += 1
    return 1e3 * np.array(round_trips), 1e3 * np.array(late), failed


def arm(bus: PlcBus) -> None:
    """Reset and enable, at the position where the drives are."""
    for control in (Control.RUN, Control.RUN | Control.RESET, Control.RUN, ON):
        for _ in range(3):
            status = bus.exchange(bus.info.status.positions_um, control, SPEED)
            time.sleep(0.01)
    assert Status.ENABLED in status.status


def host(address: tuple[str, int], pipe: Connection) -> None:
    """Follow a ramp as a host, until killed."""
    with PlcBus(BusSettings(TcpLink(*address))) as bus:
        arm(bus)
        at = list(bus.info.status.positions_um)
        for k in range(10_000):
            at[0] += 200
            bus.exchange(at, FOLLOW, SPEED)
            if k == 50:
                pipe.send("running")
            time.sleep(0.02)


def time_to_hold(address: tuple[str, int], plc: Connection) -> float:
    """Kill a host in motion; time until the PLC has tripped and the set-points stand still [ms]."""
    near, far = multiprocessing.Pipe()
    victim = multiprocessing.Process(target=host, args=(address, far))
    victim.start()
    near.recv()
    os.kill(victim.pid or 0, signal.SIGKILL)
    killed, before = time.monotonic(), None
    while time.monotonic() < killed + 5.0:
        plc.send("state")
        state, now = plc.recv()
        if Status.WATCHDOG in state["status"] and state["active_um"] == before:
            break
        before = state["active_um"]
        time.sleep(0.002)
    victim.join()
    return 1e3 * (now - killed)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    multiprocessing.set_start_method("spawn")
    ours, theirs = multiprocessing.Pipe()
    plc = multiprocessing.Process(target=serve, args=(theirs,))
    plc.start()
    address, device = ours.recv()
    heads = ("wire", "how", "Hz", "p50", "p90", "p99", "max", "late p50", "late p99", "again", "failed")
    table = Table(*heads, title="round trip and lateness of the cycle start [ms]")
    for wire, link in (("TCP", TcpLink(*address)), ("RTU", RtuLink(device, 230400))):
        for exchange in ("fc23", "fc16_fc3"):
            for hz in (20, 50, 100):
                with PlcBus(BusSettings(link, exchange=exchange)) as bus:
                    arm(bus)
                    trips, late, failed = paced(bus, hz, seconds)
                    bus.exchange(bus.info.status.positions_um, Control(0), SPEED)
                    cells = [*np.percentile(trips, (50, 90, 99, 100)), *np.percentile(late, (50, 99))]
                    counts = (str(bus.statistics.retries), str(failed))
                    table.add_row(wire, exchange, str(hz), *(f"{cell:.2f}" for cell in cells), *counts)
    Console().print(table)
    with PlcBus(BusSettings(TcpLink(*address))) as bus:
        ours.send("silence")
        time.sleep(0.05)
        began = time.monotonic()
        try:
            bus.exchange(bus.info.status.positions_um, Control.RUN, SPEED)
        except LinkTimeoutError:
            print(f"silent PLC noticed after {1e3 * (time.monotonic() - began):.0f} ms")
        ours.send("clear")
    holds = [time_to_hold(address, ours) for _ in range(5)]
    print(f"kill -9 of the host to drives at rest: {', '.join(f'{hold:.0f}' for hold in holds)} ms")
    ours.send("stop")
    plc.join()


if __name__ == "__main__":
    main()
