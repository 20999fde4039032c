"""Tools that we did not write, on either end: mbpoll (libmodbus) asks our PLC, modbus-tk takes our writes."""

from __future__ import annotations

import shutil
import struct
import subprocess
import time

import pytest
import serial
from modbus_tk import defines, modbus_rtu, modbus_tcp

from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.registers import Control
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink

needs_mbpoll = pytest.mark.skipif(
    shutil.which("mbpoll") is None, reason="mbpoll is not installed (apt-get install mbpoll)"
)
needs_socat = pytest.mark.skipif(
    shutil.which("socat") is None, reason="socat is not installed (apt-get install socat)"
)
SETPOINTS = (12_500, -1, 0, 70_000, -60_000, 2_000_000_000)
RUN = Control.RUN
PATIENT_S = 1.0


@pytest.fixture
def line(tmp_path):
    """Two serial devices joined by socat."""
    ends = [tmp_path / name for name in ("host", "plc")]
    command = ["socat", *(f"pty,raw,echo=0,link={end}" for end in ends)]
    with subprocess.Popen(command) as socat:
        try:
            end = time.monotonic() + 5.0
            while not all(path.exists() for path in ends):
                assert time.monotonic() < end, "socat made no pseudo-terminals"
                time.sleep(0.01)
            yield [str(path) for path in ends]
        finally:
            socat.terminate()


@pytest.fixture(params=["tcp", pytest.param("rtu", marks=needs_socat)])
def plc_and_link(request):
    """Our PLC, and how a client reaches it."""
    with PlcEmulator() as plc:
        if request.param == "tcp":
            plc.start()
            yield plc, TcpLink(*plc.address)
        else:
            host_end, plc_end = request.getfixturevalue("line")
            plc.start(tcp=None, rtu=plc_end)
            yield plc, RtuLink(host_end)


def mbpoll(link, *arguments, values=()):
    """Exit code, and the values read by address."""
    if isinstance(link, TcpLink):
        wire = ["-m", "tcp", "-p", str(link.port)]
        where = link.host
    else:
        wire = ["-m", "rtu", "-b", str(link.baud), "-P", "none"]
        where = link.device
    done = subprocess.run(
        ["mbpoll", *wire, "-a", "1", "-0", "-1", "-q", *arguments, "--", where, *map(str, values)],
        capture_output=True,
        text=True,
        timeout=20,
    )
    rows = [row.split() for row in done.stdout.splitlines() if row.startswith("[")]
    return done.returncode, {int(row[0].strip("[]:")): int(row[1], 0) for row in rows}, done.stderr


@needs_mbpoll
def test_mbpoll_reads_what_our_bus_wrote_and_where_the_drives_are(plc_and_link):
    plc, link = plc_and_link
    with PlcBus(BusSettings(link, timeout_s=PATIENT_S)) as bus:
        bus.exchange(SETPOINTS, RUN, 50_000)
    code, values, _ = mbpoll(link, "-r", "2", "-c", "6", "-t", "4:int", "-B")
    assert (code, tuple(values.values())) == (0, SETPOINTS)
    assert mbpoll(link, "-r", "14", "-c", "2", "-t", "4")[1] == {14: 500, 15: 1}
    assert mbpoll(link, "-r", "106", "-c", "6", "-t", "4:int", "-B")[1] == dict.fromkeys(
        range(106, 118, 2), 0
    )
    assert plc.positions_um() == (0.0,) * 6


@needs_mbpoll
def test_mbpoll_sees_identity_limits_and_moving_counters(plc_and_link):
    _, link = plc_and_link
    assert mbpoll(link, "-r", "120", "-c", "2", "-t", "4:hex")[1] == {120: 0x5443, 121: 1}
    assert mbpoll(link, "-r", "122", "-c", "1", "-t", "4:int", "-B")[1] == {122: 0x01020304}
    assert mbpoll(link, "-r", "202", "-c", "1", "-t", "4:int", "-B")[1] == {202: -35_000}
    first, second = (mbpoll(link, "-r", "105", "-c", "1", "-t", "4")[1][105] for _ in range(2))
    assert second != first


@needs_mbpoll
def test_mbpoll_may_write_commands_and_nothing_else(plc_and_link):
    plc, link = plc_and_link
    assert mbpoll(link, "-r", "2", "-t", "4:int", "-B", values=[70_000, -5])[0] == 0
    assert plc.read(2, 4) == [1, 4464, 0xFFFF, 0xFFFB]
    assert mbpoll(link, "-r", "1", "-t", "4", values=[77])[0] == 0
    time.sleep(0.02)
    assert plc.snapshot()["heartbeat"] == 77
    code, _, message = mbpoll(link, "-r", "100", "-t", "4", values=[5])
    assert (code, "Illegal data address" in message) == (1, True)
    code, _, message = mbpoll(link, "-r", "300", "-c", "1", "-t", "4")
    assert (code, "Illegal data address" in message) == (1, True)


def table():
    """Registers of a PLC that runs, written down by hand."""
    words = [0] * 240
    words[100:106] = [0x0603, 0, 0, 0, 0, 9]
    words[106:118] = struct.unpack(">12H", struct.pack(">6i", 1, -2, 3, -4, 5, -6))
    words[120:124] = [0x5443, 1, 0x0102, 0x0304]
    words[200] = 200
    words[202:214] = struct.unpack(">12H", struct.pack(">6i", *[-60_000] * 6))
    words[214:226] = struct.unpack(">12H", struct.pack(">6i", *[60_000] * 6))
    words[226:230] = struct.unpack(">4H", struct.pack(">2i", 100_000, 6_000))
    return words


@pytest.fixture(params=["tcp", pytest.param("rtu", marks=needs_socat)])
def modbus_tk(request):
    """A modbus-tk server with the registers of a PLC, and how to reach it."""
    if request.param == "tcp":
        server = modbus_tcp.TcpServer(port=0, address="127.0.0.1")
        server.start()
        while server._sock is None or not server._sock.getsockname()[1]:
            time.sleep(0.01)
        link = TcpLink(*server._sock.getsockname()[:2])
    else:
        host_end, plc_end = request.getfixturevalue("line")
        server = modbus_rtu.RtuServer(serial.Serial(plc_end, 115200, timeout=0.01))
        server.start()
        link = RtuLink(host_end)
    slave = server.add_slave(1)
    slave.add_block("all", defines.HOLDING_REGISTERS, 0, 240)
    slave.set_values("all", 0, table())
    yield slave, link
    server.stop()


@pytest.mark.filterwarnings("ignore::DeprecationWarning:modbus_tk")
@pytest.mark.parametrize("exchange", ["fc23", "fc16_fc3"])
def test_a_modbus_tk_server_takes_our_writes_and_gives_us_its_positions(modbus_tk, exchange):
    slave, link = modbus_tk
    with PlcBus(BusSettings(link, timeout_s=PATIENT_S, exchange=exchange)) as bus:
        assert bus.info.limits.max_um == (60_000,) * 6
        status = bus.exchange(SETPOINTS, Control.ENABLE | Control.FOLLOW | RUN, 50_000)
    assert status.positions_um == (1, -2, 3, -4, 5, -6)
    written = struct.pack(">16H", *slave.get_values("all", 0, 16))
    assert written.hex(" ", 2) == (
        "0007 0001 0000 30d4 ffff ffff 0000 0000 0001 1170 ffff 15a0 7735 9400 01f4 0001"
    )
