"""Whatever bytes a PLC answers with: our own errors only, in bounded time and memory.

    TCRCTL_MUTANTS=100000 python -m pytest tests/hardware/modbus/test_modbus_fuzz.py

lets more answers be mutated than the suite has time for.
"""

from __future__ import annotations

import gc
import logging
import os
import time
import tracemalloc
from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.modbus_mutants import MutatingWire
from tcr_hardware.emulators.modbus_rtu import LONGEST_FRAME, request_length
from tcr_hardware.emulators.modbus_server import ModbusServer
from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.emulators.plc_faults import PlcFaults
from tcr_hardware.errors import HardwareError
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.errors import LinkTimeoutError
from tcr_hardware.modbus.registers import Control
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink
from tcr_hardware.modbus.status import PlcStatus

MUTANTS = int(os.environ.get("TCRCTL_MUTANTS", "300"))
TIMEOUT_S = 0.001
#: A mutated answer may cost this much beyond its time-outs, on a machine that does other work.
SLACK_S = 0.5


@contextmanager
def mutating(link, seed, exchange="auto"):
    """An open bus whose wire mutates from now on; the time-out is so short that a busy machine opens it twice."""
    wire = MutatingWire(PlcEmulator(), seed, serial=isinstance(link, RtuLink))
    bus = PlcBus(BusSettings(link, timeout_s=TIMEOUT_S, retries=0, exchange=exchange), dial=lambda: wire)
    try:
        for _ in range(100):
            with suppress(LinkTimeoutError):
                bus.open()
                break
        wire.mutate = True
        yield bus
    finally:
        wire.cut()


def outcome_of_an_exchange(bus):
    try:
        status = bus.exchange((0,) * 6, Control.RUN, 1000)
    except HardwareError as error:
        return type(error).__name__
    assert isinstance(status, PlcStatus)
    assert all(getattr(status, item.name) is not None for item in fields(status))
    return "answer"


@pytest.mark.slow
@pytest.mark.parametrize("link", [TcpLink("plc"), RtuLink("plc")], ids=["tcp", "rtu"])
@pytest.mark.parametrize("exchange", ["fc23", "fc16_fc3"])
def test_no_answer_of_a_plc_raises_anything_but_our_errors(link, exchange):
    seen, slowest = Counter(), 0.0
    for start in range(0, MUTANTS // 4, 25):
        with mutating(link, start, exchange) as bus:
            for _ in range(25):
                began = time.monotonic()
                seen[outcome_of_an_exchange(bus)] += 1
                slowest = max(slowest, time.monotonic() - began)
    assert slowest < SLACK_S
    assert {"answer", "LinkTimeoutError"} <= set(seen), seen
    print(
        f"{sum(seen.values())} mutants over {link}, {exchange}: {dict(seen)}, slowest {1e3 * slowest:.1f} ms"
    )


@pytest.mark.slow
def test_mutated_answers_leave_no_memory_behind(caplog):
    caplog.set_level(logging.CRITICAL + 1, logger="pymodbus")  # pytest keeps every message
    sizes = []
    with mutating(TcpLink("plc"), 1) as bus:
        tracemalloc.start()
        try:
            for k in range(120):
                with suppress(HardwareError):
                    bus.exchange((0,) * 6, Control.RUN, 1000)
                if k in (39, 119):
                    gc.collect()  # errors and their tracebacks refer to each other
                    sizes.append(tracemalloc.get_traced_memory()[0])
            assert tracemalloc.get_traced_memory()[1] < 4e6
        finally:
            tracemalloc.stop()
    assert sizes[1] - sizes[0] < 50_000


functions = st.sampled_from([1, 3, 4, 6, 16, 23, 43, 0x83, 255])


@given(functions, st.binary(max_size=60))
def test_the_emulated_plc_answers_every_request_with_an_answer_or_an_exception(function, body):
    plc = PlcEmulator()
    answer = ModbusServer(1, plc, PlcFaults(lambda name, is_set: None)).answer(bytes([function]) + body)
    assert answer[0] == function or (answer[0] == function | 0x80 and answer[1] in (1, 2, 3))
    assert len(answer) <= 253
    assert plc.read(120, 2) == [0x5443, 1]


@given(st.binary(max_size=400))
def test_the_length_of_a_serial_request_is_bounded_by_its_first_bytes(start):
    assert 0 <= request_length(start) <= LONGEST_FRAME + 12
