"""The envelope, frame order and clock of NatNet, without a network."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support import natnet_wire as wire
from support.natnet_wire import VERSIONS
from tcr_hardware.natnet import protocol
from tcr_hardware.natnet.clock import LARGEST_DRIFT, ServerClock
from tcr_hardware.natnet.errors import MalformedPacketError
from tcr_hardware.natnet.order import AGREEING, AGREEING_NEAR, REORDER_WINDOW, Arrival, FrameOrder
from tcr_hardware.natnet.protocol import Message, ServerInfo, Version
from tcr_hardware.natnet.settings import NatNetSettings
from tcr_hardware.natnet.timers import Timers


@pytest.mark.parametrize("version", VERSIONS)
def test_server_info_of_every_version_has_the_size_of_real_ones(version):
    payload = wire.server_info(version, multicast=1)
    assert len(payload) + 4 == (283 if version >= (3, 0) else 268)
    info = ServerInfo.decode(payload)
    assert info.application == "Motive"  # and not the garbage behind it
    assert info.application_version == (3, 1, 0, 1)
    assert info.version == version
    assert info.clock_hz == (10_000_000 if version >= (3, 0) else 0)
    assert info.multicast == (True if version >= (3, 0) else None)
    assert (info.data_port, info.group) == (1511, "239.255.42.99")


@pytest.mark.parametrize("size", [0, 4, 263, 264, 278])
def test_a_short_server_info_is_refused(size):
    with pytest.raises(MalformedPacketError):
        ServerInfo.decode(wire.server_info((3, 0))[:size])


def test_the_requests_of_the_client_are_these_bytes():
    connect = protocol.connect(Version(4, 1))
    assert connect[:4].hex() == "00000d01"  # CONNECT, 269 bytes
    assert connect[4:12] == b"tcrctl\0\0"
    assert connect[4 + 256 :].hex() == "00000000040300000004010000"
    assert protocol.connect()[-5:].hex() == "0000000000"
    assert protocol.request("FrameRate").hex() == "02000a00" + b"FrameRate\0".hex()
    assert protocol.envelope(Message.KEEPALIVE).hex() == "0a000000"
    assert protocol.envelope(Message.REQUEST_MODELDEF).hex() == "04000000"
    assert protocol.echo_request(258).hex() == "0c0008000201000000000000"
    assert protocol.envelope(Message.DISCONNECT).hex() == "09000000"
    assert int(Message.UNRECOGNIZED_REQUEST) == 100


def test_a_datagram_is_as_long_as_it_says_or_longer():
    assert protocol.split(wire.packet(7, b"abc")) == (7, b"abc")
    assert protocol.split(wire.packet(7, b"abc") + b"\0") == (7, b"abc")
    for datagram in (b"", b"\7\0\3", wire.packet(7, b"abc")[:-1]):
        with pytest.raises(MalformedPacketError):
            protocol.split(datagram)


def test_versions_are_read_and_ordered_as_numbers():
    assert Version.parse("2.10") > Version.parse("2.9")
    assert Version.parse("4.1.0.0") == (4, 1)
    assert str(Version(3, 0)) == "3.0"
    for text in ("4", "4.x", "", "-1.0", "4.1b"):
        with pytest.raises(ValueError, match="not a NatNet version"):
            Version.parse(text)


@pytest.mark.parametrize(
    "wrong", [{"command_port": 0}, {"data_port": 70_000}, {"echo_s": 0.0}, {"keep_alive_s": float("nan")}]
)
def test_impossible_settings_are_named(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        NatNetSettings(**wrong)


# ---- order of frames ----


def fed(numbers, *, period=1 / 240):
    order = FrameOrder()
    return order, [order.classify(number, 100.0 + k * period) for k, number in enumerate(numbers)]


@pytest.mark.slow
@settings(max_examples=200)
@given(random=st.randoms(use_true_random=True), loss=st.sampled_from([0.0, 0.01, 0.1, 0.5]))
def test_whatever_the_network_does_every_frame_is_used_at_most_once_and_in_order(random, loss):
    """Loss, repetition and reordering by up to 3: used + late + lost = sent, and the used numbers rise."""
    sent = range(1000, 1000 + random.randint(2, 300))
    received = [n for n in sent if n in (sent[0], sent[-1]) or random.random() >= loss]
    received = [n for _, n in sorted((k + random.randint(0, 3), n) for k, n in enumerate(received))]
    for at in sorted(random.sample(range(len(received)), min(5, len(received))), reverse=True):
        received.insert(at + 1, received[at])
    first = received[0]
    order, arrivals = fed(received)
    used = [n for n, arrival in zip(received, arrivals, strict=True) if arrival is Arrival.NEXT]
    assert used == sorted(set(used))
    assert Arrival.NEW_SESSION not in arrivals
    after = {n for n in received if n >= first}
    assert len(used) + order.late == len(after)
    assert order.lost == (sent[-1] - first + 1) - len(after)


def test_gaps_late_and_repeated_frames_are_counted():
    order, arrivals = fed([1, 2, 5, 4, 4, 5, 6])
    nxt, late, again = Arrival.NEXT, Arrival.LATE, Arrival.DUPLICATE
    assert arrivals == [nxt, nxt, nxt, late, again, again, nxt]
    assert (order.lost, order.late, order.duplicates, order.sessions) == (1, 1, 2, 1)


def test_a_frozen_stream_is_one_frame():
    order, arrivals = fed([5] + [5] * 500)
    assert arrivals.count(Arrival.NEXT) == 1
    assert order.duplicates == 500


def test_a_server_that_counts_from_zero_again_is_a_new_session_after_three_frames():
    order, arrivals = fed([5000, 5001, 0, 1, 2, 3])
    assert arrivals[2:] == [Arrival.UNDECIDED] * (AGREEING - 1) + [Arrival.NEW_SESSION, Arrival.NEXT]
    assert (order.sessions, order.lost, order.undecided) == (2, 0, AGREEING - 1)


def test_a_restart_is_certain_at_once_after_silence_or_with_changed_models():
    order, _ = fed([5000, 5001])
    assert order.classify(0, 102.0) is Arrival.NEW_SESSION
    order, _ = fed([5000, 5001])
    assert order.classify(0, 100.1, models_changed=True) is Arrival.NEW_SESSION


def test_a_restart_soon_after_the_start_is_noticed_too():
    order, arrivals = fed([*range(40), *range(AGREEING_NEAR)])
    assert arrivals[-1] is Arrival.NEW_SESSION
    assert order.sessions == 2


@pytest.mark.parametrize("strange", [2**31 - 1, -5, 5_000_000, 3])
def test_one_corrupt_number_changes_nothing(strange):
    order, arrivals = fed([1000, 1001, strange, 1002, 1003])
    assert arrivals[3:] == [Arrival.NEXT, Arrival.NEXT]
    assert (order.lost, order.sessions, order.last) == (0, 1, 1003)


def test_a_jump_forward_in_playback_is_a_new_session_and_no_loss():
    order, arrivals = fed([10, 11, 900_000, 900_001, 900_002, 900_003])
    assert arrivals[-2:] == [Arrival.NEW_SESSION, Arrival.NEXT]
    assert order.lost == 0


def test_numbers_missed_long_ago_are_forgotten():
    order, _ = fed(range(0, 100 * REORDER_WINDOW, 2))
    assert len(order._missing) <= 4 * REORDER_WINDOW


# ---- the server's clock ----

HZ = 10_000_000


@pytest.mark.slow
@settings(max_examples=100)
@given(
    offset=st.floats(-1e6, 1e6),
    drift=st.floats(-0.99 * LARGEST_DRIFT, 0.99 * LARGEST_DRIFT),
    ways=st.lists(st.tuples(st.floats(1e-5, 5e-3), st.floats(1e-5, 5e-3)), min_size=1, max_size=40),
)
def test_the_offset_is_within_its_bound_whatever_the_two_ways_take(offset, drift, ways):
    """Truth: server = (1 + drift) t - offset; the two ways may differ by any amount."""
    clock, t = ServerClock(), 50.0
    clock.reset(HZ)
    for there, back in ways:
        ticks = round(((1.0 + drift) * (t + there) + 2e6 - offset) * HZ)
        assert not clock.add(t, t + there + back, ticks)
        t += 0.25
        now_ticks = round(((1.0 + drift) * t + 2e6 - offset) * HZ)
        assert abs(clock.local(now_ticks) - t) <= clock.uncertainty(t) + 1e-6


def test_a_short_round_trip_counts_longer_than_a_late_long_one():
    clock = ServerClock()
    clock.reset(HZ)
    clock.add(1.0, 1.0002, 10 * HZ)
    best = clock.best
    clock.add(1.25, 1.2600, round(10.25 * HZ))
    assert clock.best is best
    assert clock.round_trip == pytest.approx(0.01)
    clock.add(9.0, 9.0004, 18 * HZ)  # the drift of eight seconds has eaten the advantage
    assert clock.best is not best


def test_a_clock_that_was_set_anew_is_noticed():
    clock = ServerClock()
    clock.reset(HZ)
    assert not clock.add(1.0, 1.0002, 10 * HZ)
    assert clock.add(1.25, 1.2502, 510 * HZ)
    assert clock.steps == 1
    assert clock.local(510 * HZ) == pytest.approx(1.2501)


def test_a_small_contradiction_moves_the_clock_but_is_no_restart():
    """A drift that nobody promised, 5 ms in a quarter of a second."""
    clock = ServerClock()
    clock.reset(HZ)
    clock.add(1.0, 1.0002, 10 * HZ)
    assert not clock.add(1.25, 1.2502, round(10.255 * HZ))
    assert clock.steps == 0
    assert clock.local(round(10.255 * HZ)) == pytest.approx(1.2501, abs=1e-6)


def test_without_ticks_or_echo_there_is_no_local_time():
    clock = ServerClock()
    clock.reset(HZ)
    assert clock.local(5 * HZ) is None
    clock.add(1.0, 1.0002, 10 * HZ)
    assert clock.local(0) is None
    clock.reset(0)
    assert not clock.add(1.0, 1.0002, 10 * HZ)
    assert clock.uncertainty(2.0) is None


def test_timers_come_back_after_their_periods():
    timers = Timers(0.0, a=1.0, b=0.25)
    assert timers.due("a", 0.0)
    assert not timers.due("a", 0.5)
    assert timers.until_next(0.9) == pytest.approx(0.1)
    timers.now_due("a")
    assert timers.due("a", 0.9)
    assert timers.until_next(0.95) == pytest.approx(0.25)
