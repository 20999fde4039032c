"""The bus against the emulated PLC on loopback: TCP, and RTU over a pseudo-terminal, with and without faults."""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import replace

import pytest

from tcr_hardware.emulators.plc import PlcEmulator, PlcSettings
from tcr_hardware.emulators.plc_faults import FAULTS, UnknownFaultError
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.errors import HardwareError
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.errors import (
    ImplausibleAnswerError,
    LinkError,
    LinkLostError,
    LinkTimeoutError,
    MapError,
    PlcExceptionError,
    PlcFrozenError,
    PlcMismatchError,
    SetpointError,
    StaleAnswerError,
    WrongEchoError,
)
from tcr_hardware.modbus.registers import Control, FaultCode, Reject, Status, register_map
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink

ON = Control.ENABLE | Control.RUN
FOLLOW = ON | Control.FOLLOW
STILL = (0,) * 6
SPEED = 50_000
#: Answers may take long on a machine that does other work; where a time-out is wanted it is set shorter.
PATIENT_S = 0.5


#: A machine that does other work must not trip the watchdog of tests that are not about it.
CALM = PlcSettings(limits=PlcLimitSettings(watchdog_ms=3000))


@pytest.fixture
def watched_plc():
    """A PLC with the usual watchdog."""
    with PlcEmulator() as emulator:
        emulator.start()
        yield emulator


@pytest.fixture
def plc(request):
    """A PLC whose watchdog is slow."""
    with PlcEmulator(CALM) as emulator:
        tcp_only = "wire" in request.fixturenames and request.getfixturevalue("wire") == "tcp"
        emulator.start(rtu=None if tcp_only else "pty")
        yield emulator


def settings_for(plc, wire="tcp", **changes):
    link = TcpLink(*plc.address) if wire == "tcp" else RtuLink(plc.device)
    return BusSettings(link, **{"timeout_s": PATIENT_S, **changes})


@pytest.fixture(params=["tcp", "rtu"])
def wire(request):
    return request.param


@pytest.fixture(params=["fc23", "fc16_fc3"])
def exchange(request):
    return request.param


@pytest.fixture
def bus(plc, wire):
    with PlcBus(settings_for(plc, wire)) as opened:
        yield opened


def eventually(condition, within_s=3.0):
    """Whether something becomes true in time."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False


def settle(bus, setpoints, control, *, exchanges=20, pause_s=0.004):
    """Send the same set until the PLC has acted on it."""
    for _ in range(exchanges):
        status = bus.exchange(setpoints, control, SPEED)
        time.sleep(pause_s)
    return status


def test_opening_finds_the_limits_and_writes_nothing(plc, wire):
    with PlcBus(settings_for(plc, wire)) as bus:
        limits = bus.info.limits
    assert (limits.watchdog_ms, limits.step_max_um, limits.vmax_um_s) == (3000, 6000, 100_000)
    assert limits.min_um == (-35_000,) * 6
    assert limits.max_um == (95_000,) * 6
    assert Status.READY in bus.info.status.status
    assert plc.read(0, 16) == [0] * 16


@pytest.mark.slow
def test_an_armed_robot_goes_where_it_is_sent_and_says_so(plc, wire, exchange):
    with PlcBus(settings_for(plc, wire, exchange=exchange)) as bus:
        status = settle(bus, STILL, Control.RUN, exchanges=3)
        assert status.ack_lag <= 1
        assert Status.ENABLED in settle(bus, STILL, ON, exchanges=3).status
        target = (1000, -1000, 2000, -2000, 3000, -3000)
        status = settle(bus, target, FOLLOW, exchanges=60)
        assert status.reject is Reject.NONE
        assert status.positions_um == pytest.approx(target, abs=20)
        assert plc.positions_um() == pytest.approx(target, abs=20)
        assert bus.read_slow().active_um == target
        assert bus.statistics.retries == 0


def test_every_exchange_moves_seq_and_heartbeat_by_one_also_over_the_wrap(bus, plc):
    plc.write(0, [0, 0xFFFD] + [0] * 13 + [0xFFFE])
    assert eventually(lambda: plc.snapshot()["heartbeat"] == 0xFFFD)
    bus.open()
    sent = []
    for _ in range(4):
        bus.exchange(STILL, Control.RUN, SPEED)
        sent.append((plc.read(1, 1)[0], plc.read(15, 1)[0]))
    assert sent == [(0xFFFE, 0xFFFF), (0xFFFF, 0), (0, 1), (1, 2)]
    assert eventually(lambda: plc.snapshot()["seq_ack"] == 2)


@pytest.mark.slow
@pytest.mark.parametrize("low_first", [False, True])
def test_a_plc_with_either_word_order_is_understood_when_the_order_may_be_any(low_first):
    with PlcEmulator(replace(CALM, low_word_first=low_first)) as plc:
        plc.start()
        with PlcBus(settings_for(plc, word_order="auto")) as bus:
            assert bus.info.word_order == ("low_first" if low_first else "high_first")
            settle(bus, STILL, ON, exchanges=3)
            status = settle(bus, (1500, -1, 2, 3, 4, 5), FOLLOW, exchanges=60)
            assert status.positions_um == pytest.approx((1500, -1, 2, 3, 4, 5), abs=20)


@pytest.mark.slow
def test_a_site_may_have_its_own_addresses_and_formats(wire):
    changes = {
        "SP": {"address": 40, "kind": "float32", "scale": 1000.0},
        "CTRL": {"address": 38},
        "HEARTBEAT": {"address": 39},
        "VMAX": {"address": 52},
        "SEQ": {"address": 53},
        "ACT": {"scale": 10.0},
    }
    rows = register_map(6, changes)
    with PlcEmulator(replace(CALM, map=rows)) as plc:
        plc.start(rtu="pty")
        with PlcBus(settings_for(plc, wire, map=rows)) as bus:
            settle(bus, STILL, ON, exchanges=3)
            status = settle(bus, (1500, -1500, 0, 0, 0, 0), FOLLOW, exchanges=60)
            assert status.positions_um == pytest.approx((1500, -1500, 0, 0, 0, 0), abs=20)
            assert all(position % 10 == 0 for position in status.positions_um)


@pytest.mark.slow
def test_a_plc_without_function_23_is_found_out_at_the_first_exchange(plc, wire):
    plc.faults.set("exception", code=1, function=23)
    with PlcBus(settings_for(plc, wire)) as bus:
        settle(bus, STILL, ON, exchanges=3)
        assert settle(bus, (500,) * 6, FOLLOW, exchanges=40).positions_um == pytest.approx((500,) * 6, abs=20)
    with (
        PlcBus(settings_for(plc, wire, exchange="fc23")) as bus,
        pytest.raises(PlcExceptionError, match="illegal function"),
    ):
        bus.exchange(STILL, Control.RUN, SPEED)


@pytest.mark.parametrize("fault", ["wrong_magic", "wrong_version", "word_swap"])
def test_a_plc_that_is_not_the_one_of_the_map_is_not_opened(plc, wire, fault):
    plc.faults.set(fault)
    bus = PlcBus(settings_for(plc, wire))
    with pytest.raises(PlcMismatchError):
        bus.open()
    with pytest.raises(LinkLostError, match="not open"):
        bus.exchange(STILL, FOLLOW, SPEED)


def test_a_map_that_the_plc_does_not_have_is_refused_with_the_address(plc):
    with pytest.raises(PlcExceptionError, match="illegal data address"):
        PlcBus(settings_for(plc, map=register_map(6, {"STEPMAX": {"address": 240}}))).open()


@pytest.mark.parametrize(
    "change", [{"exchange": "fc24"}, {"word_order": "middle_first"}, {"byte_order": "odd"}]
)
def test_a_setting_that_does_not_exist_is_refused_with_those_that_do(change):
    with pytest.raises(MapError, match="allowed: "):
        PlcBus(BusSettings(TcpLink("127.0.0.1"), **change))


def test_nobody_listening_is_named_with_its_address():
    with pytest.raises(LinkLostError, match=r"127\.0\.0\.1:1: .*refused"):
        PlcBus(BusSettings(TcpLink("127.0.0.1", 1))).open()


def test_a_serial_device_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(LinkLostError, match="cannot open") as lost:
        PlcBus(BusSettings(RtuLink(str(tmp_path / "ttyS9")))).open()
    assert "no such device" in lost.value.hint


def test_a_closed_bus_stays_closed_until_it_is_opened_again(bus, plc):
    bus.exchange(STILL, Control.RUN, SPEED)
    bus.close()
    bus.close()
    before = plc.read(0, 16)
    for use in (lambda: bus.exchange(STILL, Control.RUN, SPEED), bus.read_status, bus.read_slow):
        with pytest.raises(LinkLostError, match="not open"):
            use()
    assert plc.read(0, 16) == before
    bus.open()
    bus.exchange(STILL, Control.RUN, SPEED)


def test_a_bad_set_point_is_never_sent_and_does_not_count(bus, plc):
    bus.exchange(STILL, Control.RUN, SPEED)
    before = plc.read(0, 16)
    for bad in (float("nan"), 2**31):
        with pytest.raises(SetpointError):
            bus.exchange((0, 0, bad, 0, 0, 0), FOLLOW, SPEED)
    assert plc.read(0, 16) == before


@pytest.mark.parametrize("code", [2, 3, 4, 6, 99])
def test_an_exception_answer_is_an_error_with_its_code_and_is_not_repeated(bus, plc, code):
    plc.faults.set("exception", code=code)
    with pytest.raises(PlcExceptionError) as refused:
        bus.exchange(STILL, Control.RUN, SPEED)
    assert refused.value.code == code
    assert bus.statistics.retries == 0
    plc.faults.clear()
    bus.exchange(STILL, Control.RUN, SPEED)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["silence", "corrupt", "truncate", "wrong_echo"])
def test_a_single_bad_answer_is_survived_by_one_retry_of_the_same_set(plc, wire, exchange, fault):
    with PlcBus(settings_for(plc, wire, exchange=exchange, timeout_s=0.2)) as bus:
        settle(bus, STILL, ON, exchanges=3)
        status = settle(bus, STILL, FOLLOW, exchanges=3)
        plc.faults.set(fault, count=1)
        after = bus.exchange((100,) * 6, FOLLOW, SPEED)
        assert after.seq == (status.seq + 1) & 0xFFFF
        # Without a check sum nobody can know that the last byte of a position is wrong.
        spoiled_number = wire == "tcp" and fault == "corrupt" and exchange == "fc23"
        assert after.attempts == (1 if spoiled_number else 2)
        assert settle(bus, (100,) * 6, FOLLOW).positions_um == pytest.approx((100,) * 6, abs=20)


@pytest.mark.slow
def test_a_silent_plc_is_noticed_within_the_time_of_its_attempts(plc, wire):
    with PlcBus(settings_for(plc, wire, timeout_s=0.06)) as bus:
        bus.exchange(STILL, Control.RUN, SPEED)
        plc.faults.set("silence")
        began = time.monotonic()
        with pytest.raises(LinkTimeoutError):
            bus.exchange(STILL, Control.RUN, SPEED)
        assert 0.12 <= time.monotonic() - began <= 1.0
        assert bus.statistics.timeouts == 2


def test_without_retries_one_silence_is_an_error(plc, wire):
    with PlcBus(settings_for(plc, wire, timeout_s=0.05, retries=0)) as bus:
        plc.faults.set("silence", count=1)
        with pytest.raises(LinkTimeoutError):
            bus.exchange(STILL, Control.RUN, SPEED)
        assert bus.statistics.timeouts == 1


@pytest.mark.slow
def test_a_late_answer_never_passes_for_the_next_one(plc, wire, exchange):
    with PlcBus(settings_for(plc, wire, exchange=exchange, timeout_s=0.15, retries=0)) as bus:
        settle(bus, STILL, ON, exchanges=3)
        seen = []
        for k in range(1, 9):
            if k in (3, 4, 6):
                plc.faults.set("delay", seconds=0.17, count=1)
            cycle = plc.snapshot()["cycle"]
            try:
                status = bus.exchange((10 * k,) * 6, ON, SPEED)
            except LinkError:
                seen.append(None)
            else:
                seen.append(k)
                assert status.plc_cycle >= cycle
            time.sleep(0.01)
        assert seen.count(None) >= 2
        assert eventually(lambda: _answers(bus))


@pytest.mark.parametrize("retries", [0, 1, 2])
def test_opening_gives_up_on_a_plc_that_no_exchange_could_ever_hear(plc, retries):
    plc.faults.set("delay", seconds=0.3)
    begun = time.monotonic()
    with pytest.raises(LinkTimeoutError, match=r"come after 3\d\d ms, allowed are 60 ms") as late:
        PlcBus(settings_for(plc, timeout_s=0.06, retries=retries)).open()
    assert time.monotonic() - begun < 0.3 * (max(retries, 1) + 1) + 0.25
    assert "timeout_ms" in late.value.hint


@pytest.mark.parametrize("retries", [0, 1])
def test_opening_bears_answers_that_are_late_only_at_first(plc, retries):
    plc.faults.set("delay", seconds=0.3, count=1)
    with PlcBus(settings_for(plc, timeout_s=0.06, retries=retries)) as bus:
        assert bus.info.limits.watchdog_ms == 3000


def test_late_answers_on_a_serial_line_are_counted(plc):
    with PlcBus(settings_for(plc, "rtu", timeout_s=0.3, retries=1)) as bus:
        bus.exchange(STILL, Control.RUN, SPEED)
        plc.faults.set("delay", seconds=0.33, count=1)
        assert bus.exchange(STILL, Control.RUN, SPEED).attempts == 2
        assert bus.statistics.timeouts == 1


def test_after_a_reset_the_plc_is_identified_again_before_the_set_is_repeated(plc):
    with PlcBus(settings_for(plc)) as bus:
        first = bus.exchange(STILL, Control.RUN, SPEED)
        plc.faults.set("reset")
        again = bus.exchange(STILL, Control.RUN, SPEED)
        assert (again.seq, again.attempts) == (first.seq + 1, 2)
        assert bus.statistics.reconnects == 1
        plc.faults.set("wrong_magic")
        plc.faults.set("reset")
        before = plc.read(0, 16)
        for _ in range(3):
            with pytest.raises(PlcMismatchError):
                bus.exchange(STILL, Control.RUN, SPEED)
        assert plc.read(0, 16) == before


def test_a_refused_connection_is_an_error_until_the_plc_listens_again(plc):
    with PlcBus(settings_for(plc, timeout_s=0.1)) as bus:
        plc.faults.set("refuse")
        assert eventually(lambda: not _answers(bus))
        plc.faults.clear("refuse")
        assert eventually(lambda: _answers(bus))


def _answers(bus):
    try:
        bus.exchange(STILL, Control.RUN, SPEED)
    except LinkError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "register"),
    [("freeze_ack", "SEQ_ACK"), ("freeze_heartbeat", "HB_ECHO"), ("freeze_program", "PLC_CYCLE")],
)
def test_a_plc_that_answers_without_running_is_found_out(bus, plc, fault, register):
    bus.exchange(STILL, Control.RUN, SPEED)
    plc.faults.set(fault)
    with pytest.raises(PlcFrozenError) as frozen:
        settle(bus, STILL, Control.RUN, exchanges=200)
    assert frozen.value.register == register


def test_a_frozen_acknowledge_is_found_out_also_by_a_host_that_reads_in_between(bus, plc):
    bus.exchange(STILL, Control.RUN, SPEED)
    plc.faults.set("freeze_ack")

    def watch():
        for _ in range(200):
            settle(bus, STILL, Control.RUN, exchanges=1)
            bus.read_status()

    with pytest.raises(PlcFrozenError, match="SEQ_ACK"):
        watch()


@pytest.mark.slow
def test_refused_sets_are_reported_and_do_not_count_as_frozen(bus):
    settle(bus, STILL, ON, exchanges=3)
    for _ in range(40):
        status = bus.exchange((0, 0, 7000, 0, 0, 0), FOLLOW, SPEED)
        time.sleep(0.004)
    assert (status.reject, status.reject_axis) == (Reject.STEP, 3)
    assert bus.statistics.rejects >= 30


@pytest.mark.slow
def test_a_word_order_that_changes_under_way_is_noticed_on_both_ends(bus, plc):
    settle(bus, STILL, ON, exchanges=3)
    settle(bus, (1000,) * 6, FOLLOW, exchanges=40)
    plc.faults.set("word_swap")
    with pytest.raises(ImplausibleAnswerError):
        settle(bus, (1100,) * 6, FOLLOW)
    assert eventually(lambda: plc.snapshot()["reject"][0] is Reject.RANGE)
    assert plc.positions_um() == pytest.approx((1000,) * 6, abs=20)


@pytest.mark.slow
def test_a_host_that_dies_leaves_a_robot_that_holds_within_the_watchdog_time(watched_plc):
    with PlcBus(settings_for(watched_plc)) as bus:
        settle(bus, STILL, ON, exchanges=3)
        for k in range(1, 6):
            bus.exchange((500 * k,) * 6, FOLLOW, SPEED)
            time.sleep(0.01)
    assert eventually(lambda: Status.WATCHDOG in watched_plc.snapshot()["status"])
    held = watched_plc.snapshot()["active_um"]
    time.sleep(0.05)
    assert watched_plc.snapshot()["active_um"] == held
    with PlcBus(settings_for(watched_plc)) as bus:
        assert Status.WATCHDOG in settle(bus, STILL, FOLLOW).status
        assert watched_plc.snapshot()["active_um"] == held
        settle(bus, STILL, Control.RUN | Control.RESET, exchanges=3)
        assert Status.ENABLED in settle(bus, STILL, ON, exchanges=3).status


def test_reading_does_not_feed_the_watchdog(watched_plc):
    with PlcBus(settings_for(watched_plc)) as bus:
        settle(bus, STILL, ON, exchanges=3)
        assert eventually(lambda: Status.WATCHDOG in bus.read_status().status)


@pytest.mark.slow
def test_the_estop_is_seen_and_latched(bus, plc):
    settle(bus, STILL, ON, exchanges=3)
    plc.press_estop()
    assert {Status.ESTOP, Status.FAULT} <= set(settle(bus, STILL, FOLLOW).status)
    plc.release_estop()
    status = settle(bus, STILL, FOLLOW).status
    assert Status.ESTOP not in status
    assert Status.FAULT in status


@pytest.mark.slow
def test_a_power_cycle_disables_and_the_bus_goes_on_with_the_new_counters(bus, plc):
    settle(bus, STILL, ON, exchanges=40)
    plc.faults.set("restart")
    status = settle(bus, STILL, ON, exchanges=3)
    assert Status.FAULT not in status.status
    assert status.ack_lag <= 1


def test_tensions_reach_the_load_registers_and_a_slack_cable_the_status(bus, plc):
    plc.set_tensions([5.0, 6.25, 7.0, 8.0, 9.0, 0.1])
    assert bus.read_slow().load == pytest.approx((5.0, 6.2, 7.0, 8.0, 9.0, 0.1), abs=0.051)
    assert Status.SLACK in bus.read_status().status


def test_another_master_that_writes_is_found_out(bus, plc):
    bus.exchange(STILL, Control.RUN, SPEED)
    plc.write(1, [30_000])
    time.sleep(0.05)
    with pytest.raises(StaleAnswerError, match="another master"):
        bus.read_status()


def test_wrong_echoes_that_do_not_end_are_an_error(plc, wire):
    with PlcBus(settings_for(plc, wire, exchange="fc16_fc3")) as bus:
        plc.faults.set("wrong_echo")
        with pytest.raises(WrongEchoError, match="wrote 16 registers at 0, the PLC confirms 16 at 1"):
            bus.exchange(STILL, Control.RUN, SPEED)


def test_faults_have_names_meanings_and_known_arguments(plc):
    with pytest.raises(UnknownFaultError, match="known: exception, silence"):
        plc.faults.set("gremlins")
    with pytest.raises(UnknownFaultError, match=r"known: delay\.seconds"):
        plc.faults.set("delay", minutes=1)
    with pytest.raises(UnknownFaultError):
        plc.faults.clear("gremlins")
    assert all(kind.meaning for kind in FAULTS.values())


def test_a_taken_port_is_named_and_an_emulator_starts_again_after_a_stop(plc):
    with PlcEmulator() as second, pytest.raises(HardwareError, match=f"{plc.address[1]}.*in use"):
        second.start(tcp=plc.address)
    address = plc.address
    plc.stop()
    plc.stop()
    plc.start(tcp=address)
    with PlcBus(settings_for(plc)) as bus:
        bus.exchange(STILL, Control.RUN, SPEED)


def test_a_serial_line_with_a_baud_rate_answers_no_faster_than_its_wire(plc):
    with PlcEmulator() as slow:
        slow.start(tcp=None, rtu="pty", baud=57600)
        with PlcBus(BusSettings(RtuLink(slow.device, 57600), exchange="fc23", timeout_s=PATIENT_S)) as bus:
            status = bus.exchange(STILL, Control.RUN, SPEED)
        assert status.round_trip_s >= 0.0184


@pytest.mark.slow
@pytest.mark.parametrize("axes", [1, 3, 12])
def test_a_robot_may_have_any_number_of_axes(axes):
    rows = register_map(axes)
    with PlcEmulator(replace(CALM, axes=axes)) as plc:
        plc.start()
        with PlcBus(settings_for(plc, map=rows)) as bus:
            settle(bus, (0,) * axes, ON, exchanges=3)
            target = tuple(100 * axis for axis in range(axes))
            assert settle(bus, target, FOLLOW, exchanges=40).positions_um == pytest.approx(target, abs=20)


def test_an_emulator_and_its_map_have_the_same_axes():
    with pytest.raises(HardwareError, match="3 axes cannot serve a map of 6 axes"):
        PlcEmulator(PlcSettings(axes=3, map=register_map(6)))


def test_the_emulator_leaves_no_thread_behind():
    before = threading.active_count()
    with PlcEmulator() as plc:
        plc.start(rtu="pty")
        bus = PlcBus(settings_for(plc))
        bus.open()
        bus.exchange(STILL, Control.RUN, SPEED)
    bus.close()
    assert eventually(lambda: threading.active_count() == before)


@pytest.mark.slow
def test_a_plc_whose_registers_survive_a_power_cycle_enables_nothing(bus, plc):
    settle(bus, STILL, ON)
    settle(bus, STILL, FOLLOW)
    plc.faults.set("restart", keep=1)
    assert plc.read(0, 1) == [int(FOLLOW)]
    time.sleep(0.05)
    assert Status.ENABLED not in plc.snapshot()["status"]
    for _ in range(5):
        with contextlib.suppress(LinkError):
            bus.exchange((1_000,) * 6, FOLLOW, SPEED)
        time.sleep(0.02)
    assert Status.ENABLED not in plc.snapshot()["status"]
    assert plc.positions_um() == pytest.approx((0.0,) * 6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "arguments", "code"),
    [("dead_clock", {}, FaultCode.CLOCK), ("encoder", {"axis": 3}, FaultCode.DRIVE)],
)
def test_a_plc_without_a_clock_or_an_encoder_stops_and_says_why(bus, plc, fault, arguments, code):
    settle(bus, STILL, ON)
    settle(bus, STILL, FOLLOW)
    plc.faults.set(fault, **arguments)
    end = time.monotonic() + 20.0
    while Status.ENABLED in bus.exchange(STILL, FOLLOW, SPEED).status and time.monotonic() < end:
        time.sleep(0.02)
    assert (plc.snapshot()["fault"], Status.ENABLED in plc.snapshot()["status"]) == (code, False)
