"""Register map, word order, and what a serial line can carry."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcr_hardware.modbus.blocks import Blocks, Counters, identify
from tcr_hardware.modbus.errors import MapError, PlcMismatchError, RateError, SetpointError
from tcr_hardware.modbus.registers import MAGIC, ORDER_PROBE, Control, Reject, Status, register_map
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink
from tcr_hardware.modbus.wire_time import exchange_time, share_of_period
from tcr_hardware.modbus.words import BYTE_ORDERS, WORD_ORDERS, WordCodec, probe

CODECS = [WordCodec(words, bytes_) for words in WORD_ORDERS for bytes_ in BYTE_ORDERS]
MAP = register_map()


def test_the_default_map_lies_where_the_document_of_the_bench_puts_it():
    addresses = {row.name: (row.address, row.words) for row in MAP.registers}
    assert addresses == {
        "CTRL": (0, 1), "HEARTBEAT": (1, 1), "SP": (2, 12), "VMAX": (14, 1), "SEQ": (15, 1),
        "STATUS": (100, 1), "FAULT": (101, 1), "HB_ECHO": (102, 1), "SEQ_ACK": (103, 1), "REJECT": (104, 1),
        "PLC_CYCLE": (105, 1), "ACT": (106, 12),
        "MAGIC": (120, 1), "MAP_VERSION": (121, 1), "ORDER_PROBE": (122, 2), "SP_ACTIVE": (124, 12),
        "LOAD": (136, 6),
        "WD_MS": (200, 1), "LIMITS_SPARE": (201, 1), "MIN": (202, 12), "MAX": (214, 12), "VMAX_LIMIT": (226, 2),
        "STEPMAX": (228, 2),
    }  # fmt: skip
    assert MAP.span("command") == (0, 16)
    assert MAP.span("status") == (100, 18)


@pytest.mark.parametrize("axes", range(1, 13))
def test_a_map_for_any_number_of_axes_has_seq_last_and_no_overlap(axes):
    rows = register_map(axes)
    taken = [at for row in rows.registers for at in range(row.address, row.end)]
    assert len(taken) == len(set(taken))
    assert rows["SEQ"].end == sum(rows.span("command"))


def test_a_command_block_has_these_bytes():
    words = Blocks(MAP, WordCodec()).command(
        Counters(seq=0x1234, heartbeat=0xFFFF),
        (12_500, -1, 0, 70_000, -60_000, 2**31 - 1),
        Control.ENABLE | Control.FOLLOW | Control.RUN,
        50_099,
    )
    assert struct.pack(">16H", *words).hex(" ", 2) == (
        "0007 ffff 0000 30d4 ffff ffff 0000 0000 0001 1170 ffff 15a0 7fff ffff 01f4 1234"
    )


def test_a_status_block_with_these_bytes_is_read_so():
    words = struct.unpack(
        ">18H",
        bytes.fromhex(
            "0519 0001 0007 1233 0023 ffff 0000 30d4 ffff ffff 0000 0000 0001 1170 ffff 15a0 8000 0000"
        ),
    )
    status = Blocks(MAP, WordCodec()).status(words, Counters(0x1234, 7), 5.0, 4.5, 2)
    assert status.status == Status.READY | Status.FAULT | Status.ESTOP | Status.WATCHDOG | Status.IN_POSITION
    assert (status.fault, status.heartbeat_echo, status.seq_ack, status.ack_lag) == (1, 7, 0x1233, 1)
    assert (status.reject, status.reject_axis, status.plc_cycle) == (Reject.STEP, 3, 0xFFFF)
    assert status.positions_um == (12_500, -1, 0, 70_000, -60_000, -(2**31))
    assert (status.round_trip_s, status.attempts) == (0.5, 2)


@given(
    st.sampled_from(CODECS),
    st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6),
)
def test_positions_survive_the_way_through_registers_in_every_order(codec, values):
    assert list(codec.decode(MAP["SP"], codec.encode(MAP["SP"], values))) == values


@given(st.sampled_from(CODECS), st.lists(st.floats(-1e6, 1e6, width=32), min_size=6, max_size=6))
def test_a_site_with_float_millimetres_loses_less_than_a_tenth_of_a_micrometre(codec, values):
    row = register_map(6, {"SP": {"kind": "float32", "scale": 1000.0}})["SP"]
    assert codec.decode(row, codec.encode(row, values)) == pytest.approx(values, rel=1e-6, abs=0.1)


@pytest.mark.parametrize("codec", CODECS, ids=str)
def test_the_probe_tells_the_four_orders_apart(codec):
    pair = codec.encode(MAP["ORDER_PROBE"], [ORDER_PROBE])
    assert probe(codec.encode(MAP["MAGIC"], [MAGIC])[0], pair) == codec


@given(st.integers(1, 60_000).map(lambda size: size if size % 2 else -size))
def test_a_set_point_in_the_wrong_word_order_is_outside_every_stroke(value):
    swapped = WordCodec("low_first").decode(
        MAP["VMAX_LIMIT"], WordCodec().encode(MAP["VMAX_LIMIT"], [value])
    )[0]
    assert abs(swapped) > 65_000


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ([0, 1, 0x0102, 0x0304], "MAGIC"),
        ([MAGIC, 1, 0, 0], "ORDER_PROBE"),
        ([MAGIC, 2, 0x0102, 0x0304], "MAP_VERSION"),
    ],
)
def test_another_device_is_recognised(words, name):
    with pytest.raises(PlcMismatchError) as found:
        identify(MAP, words + [0] * 18, "auto", "auto")
    assert found.value.register == name


def test_an_order_other_than_the_configured_one_is_refused_unless_it_may_be_any():
    swapped = [MAGIC, 1, 0x0304, 0x0102] + [0] * 18
    with pytest.raises(PlcMismatchError, match="low_first, expected high_first"):
        identify(MAP, swapped, "high_first", "big")
    assert identify(MAP, swapped, "auto", "big") == WordCodec("low_first")


@pytest.mark.parametrize(
    "setpoint", [float("nan"), float("inf"), 2**31, -(2**31) - 1, True, "1", None], ids=repr
)
def test_what_is_no_position_is_never_sent(setpoint):
    with pytest.raises(SetpointError):
        WordCodec().encode(MAP["SP"], [0, 0, setpoint, 0, 0, 0])


def test_whole_numbers_of_numpy_are_positions_too():
    values = np.array([1, -2, 3, -4, 5, 6])
    assert WordCodec().encode(MAP["SP"], values) == WordCodec().encode(MAP["SP"], values.tolist())


def test_a_number_too_large_for_a_float_register_is_never_sent():
    row = register_map(6, {"SP": {"kind": "float32"}})["SP"]
    with pytest.raises(SetpointError):
        WordCodec().encode(row, [1e39] * 6)


def test_a_set_of_the_wrong_size_or_without_speed_is_never_sent():
    blocks = Blocks(MAP, WordCodec())
    with pytest.raises(SetpointError, match="6 values"):
        blocks.command(Counters(), (0, 0, 0), Control(0), 1000)
    for speed in (0, 99, -5, float("nan"), 100 * 0x10000):
        with pytest.raises(SetpointError, match="VMAX"):
            blocks.command(Counters(), (0,) * 6, Control(0), speed)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"SPX": {"address": 1}}, "no such register"),
        ({"SP": {"addres": 1}}, "unknown; allowed: address, kind, scale"),
        ({"SP": {"kind": "int64"}}, "allowed: u16, i16, int32, float32"),
        ({"SP": {"scale": 0}}, "not a positive number"),
        ({"SP": {"address": -1}}, "0 to 65535"),
        ({"STATUS": {"address": 101}}, "overlaps"),
        ({"SEQ": {"address": 17}}, "gap"),
        ({"SEQ": {"address": 0}, "CTRL": {"address": 15}}, "SEQ has to be the last"),
        ({"STATUS": {"address": 300}}, "spans"),
        ({"ACT": {"address": 65530}}, "behind register 65535"),
    ],
)
def test_a_map_that_cannot_work_is_refused_with_the_reason(changes, message):
    with pytest.raises(MapError, match=message):
        register_map(6, changes)


def test_a_map_with_several_mistakes_lists_all():
    with pytest.raises(MapError) as found:
        register_map(6, {"SPX": {}, "SP": {"kind": "no", "scale": -1}})
    assert len(found.value.problems) == 3


@pytest.mark.parametrize(
    ("baud", "both_ms", "fc23_ms"),
    [(19200, 59.0, 49.0), (57600, 24.0, 18.4), (115200, 15.5, 11.0), (230400, 11.3, 7.2)],
)
def test_the_wire_time_of_a_serial_exchange_agrees_with_the_standard(baud, both_ms, fc23_ms):
    link = RtuLink("/dev/ttyS0", baud)
    assert 1e3 * exchange_time(link, 16, 18, "fc16_fc3") == pytest.approx(both_ms, rel=0.02)
    assert 1e3 * exchange_time(link, 16, 18, "fc23") == pytest.approx(fc23_ms, rel=0.02)


@pytest.mark.parametrize(
    ("baud", "hz", "exchange", "possible"),
    [
        (230400, 100, "fc23", True),
        (115200, 100, "fc23", False),
        (115200, 50, "fc23", True),
        (115200, 20, "auto", True),
        (19200, 20, "fc23", False),
    ],
)
def test_a_rate_that_the_line_cannot_carry_is_refused(baud, hz, exchange, possible):
    settings = BusSettings(RtuLink("/dev/ttyS0", baud), exchange=exchange)
    if possible:
        assert 0.0 < share_of_period(settings, 200, 1.0 / hz) <= 0.8
        return
    with pytest.raises(RateError) as refused:
        share_of_period(settings, 200, 1.0 / hz)
    assert refused.value.shortest_s > refused.value.period_s


@pytest.mark.parametrize(
    ("watchdog_ms", "period_s", "timeout_s", "message"),
    [
        (200, 0.1, 0.06, "at least 3 periods"),
        (100, 0.02, 0.06, "outlast the watchdog"),
    ],
)
def test_a_watchdog_that_would_trip_on_a_late_cycle_is_refused(watchdog_ms, period_s, timeout_s, message):
    with pytest.raises(RateError, match=message):
        share_of_period(BusSettings(TcpLink("plc"), timeout_s=timeout_s), watchdog_ms, period_s)


def test_a_time_out_shorter_than_the_exchange_itself_is_refused():
    with pytest.raises(RateError, match="time-out"):
        share_of_period(BusSettings(RtuLink("/dev/ttyS0", 19200), timeout_s=0.04), 1000, 0.2)
