"""Client and emulated Motive server over real sockets on 127.0.0.1."""

from __future__ import annotations

import contextlib
import socket
import struct
import time

import numpy as np
import pytest

from support import natnet_wire as wire
from tcr_hardware.emulators.motive import CLOCK_HZ, MotiveEmulator
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcr_hardware.errors import HardwareError, SocketError
from tcr_hardware.natnet.client import NatNetClient
from tcr_hardware.natnet.errors import RequestRefusedError, ServerSilentError, UnsupportedVersionError
from tcr_hardware.natnet.frame import MODELS_CHANGED
from tcr_hardware.natnet.senders import Senders
from tcr_hardware.natnet.settings import NatNetSettings

NAMES = [f"m{i}.n{j}" for i in (1, 2) for j in (1, 2, 3)]
POSITIONS = np.random.default_rng(6).normal(size=(6, 3)).astype(np.float32).astype(float)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def serve(**options):
    options = {"command_port": 0, "data_port": free_port(), "rate_hz": 200.0, "latency_s": 0.002} | options
    return MotiveEmulator(NAMES, lambda: POSITIONS, MotiveSettings(**options))


def client_of(motive, **options):
    multicast, data_port = motive.settings.multicast, motive.settings.data_port
    return NatNetClient(
        NatNetSettings(
            **{"command_port": motive.address[1], "multicast": multicast, "data_port": data_port, **options}
        )
    )


@contextlib.contextmanager
def linked(open_options=None, **options):
    with serve(**options) as motive:
        client = client_of(motive, **(open_options or {}))
        client.open(timeout_s=5.0)
        try:
            yield motive, client
        finally:
            client.close()


def frames(client, n, timeout_s=5.0):
    """The next ``n`` frames."""
    found, last = [], client.newest()
    end = time.monotonic() + timeout_s
    while len(found) < n and time.monotonic() < end:
        last = client.wait_next(last, 0.5) or last
        found += client.drain()
    assert len(found) >= n, client.statistics()
    return found


def eventually(condition, timeout_s=5.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def multicast_works():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            here = socket.inet_aton("127.0.0.1")
            probe.setsockopt(
                socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton("239.255.42.99") + here
            )
        except OSError:
            return False
    return True


WAYS = [
    {"multicast": False, "unicast_to": "sender"},
    {"multicast": False, "unicast_to": "data_port"},
    pytest.param(
        {"multicast": True},
        marks=pytest.mark.skipif(not multicast_works(), reason="this system has no multicast on 127.0.0.1"),
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("version", ["2.9", "3.0", "4.1"])
def test_frames_arrive_every_way_and_mean_what_was_shown(way, version):
    with linked(version=version, **way) as (emulator, client):
        received = frames(client, 10)
        assert str(client.version) == version
        assert client.server.application.startswith("Motive")
        newest = received[-1]
        by_id = {int(each["id"]): each["position"] for each in newest.data.markers}
        labels = client.wait_models().labels()
        assert sorted(labels) == sorted(NAMES)
        for row, name in enumerate(NAMES):
            assert by_id[labels[name]] == pytest.approx(POSITIONS[row])
        assert [each.sequence for each in received] == sorted(each.sequence for each in received)
        statistics = client.statistics()
        assert (statistics.malformed, statistics.foreign, statistics.sessions) == (0, 0, 1)
        if version >= "3":
            eventually(lambda: client.newest().exposure is not None)
            frame = frames(client, 1)[-1]
            late = frame.arrival - frame.exposure
            assert 0.002 - client.statistics().clock_uncertainty_s <= late < 1.0
            now = time.monotonic()
            ahead = emulator.ticks(now) / CLOCK_HZ - now  # 1000 s, and what its clock has drifted since boot
            assert client.statistics().clock_offset_s == pytest.approx(-ahead, abs=0.05)


def test_the_exposure_is_dated_within_the_bound_that_the_client_gives():
    """The scene moves with the true time, so every frame says when it was taken."""
    start = time.monotonic()
    settings = MotiveSettings(command_port=0, data_port=free_port(), rate_hz=200.0)
    moving = MotiveEmulator(NAMES, lambda: np.full((6, 3), time.monotonic() - start), settings)
    with moving as motive, client_of(motive) as client:
        eventually(lambda: client.newest() is not None and client.newest().exposure is not None)
        received, bound = frames(client, 20), client.statistics().clock_uncertainty_s + 1e-3
        shown = np.array([start + float(each.data.markers[0]["position"][0]) for each in received])
        late = shown - [
            each.exposure for each in received
        ]  # the scene is drawn after the exposure was stamped
        assert late.min() >= -bound
        assert np.median(late) <= bound + 5e-3


@pytest.mark.parametrize("asked", ["3.0", "3.1", "4.0", "4.1"])
def test_the_client_gets_the_bit_stream_that_it_asks_for(asked):
    with linked({"bitstream": asked}, version="4.3") as (_, client):
        assert str(client.version) == asked
        frames(client, 3)
        assert client.statistics().malformed == 0


def test_requests_are_answered_or_refused():
    with linked() as (_, client):
        assert client.frame_rate() == 200.0
        assert client.units_to_millimetres() == 1000.0
        assert client.request("CurrentMode") == struct.pack("<i", 0)
        with pytest.raises(RequestRefusedError, match="MakeCoffee"):
            client.request("MakeCoffee")


@pytest.mark.slow
def test_a_mute_server_is_an_error_that_names_it():
    with serve() as motive:
        motive.faults.mute = True
        with pytest.raises(ServerSilentError, match=f"127.0.0.1:{motive.address[1]}") as caught:
            client_of(motive).open(timeout_s=0.3)
        assert caught.value.awaited == "answer"
        assert caught.value.hint


@pytest.mark.slow
def test_nobody_there_is_told_apart_from_silence():
    client = NatNetClient(NatNetSettings(command_port=free_port(), multicast=False, data_port=free_port()))
    with pytest.raises(ServerSilentError) as caught:
        client.open(timeout_s=0.4)
    assert "Nobody listens" in caught.value.hint


@pytest.mark.parametrize("wrong", [{"local": "192.0.2.1"}, {"server": "no-such-host.invalid"}])
def test_an_address_that_does_not_exist_is_an_error_at_once(wrong):
    with pytest.raises(SocketError) as caught:
        NatNetClient(NatNetSettings(multicast=False, data_port=free_port(), **wrong)).open()
    assert next(iter(wrong.values())) in str(caught.value)


def test_a_newer_server_is_refused_in_multicast_and_pinned_in_unicast():
    with (
        serve(version="4.5", multicast=True) as motive,
        pytest.raises(UnsupportedVersionError, match=r"4\.4"),
    ):
        client_of(motive).open()
    with linked(version="4.5") as (_, client):
        assert str(client.version) == "4.1"
        frames(client, 3)


def test_a_data_port_in_use_still_leaves_the_command_socket():
    """Motive on the same computer holds port 1511 itself."""
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        with linked(data_port=port) as (_, client):
            assert f"not listening at 127.0.0.1:{port}" in client.statistics().last_problem
            frames(client, 3)


@pytest.mark.parametrize(
    "way",
    [
        {"unicast_to": "data_port"},
        pytest.param(
            {"multicast": True, "group": "239.255.42.98"},
            marks=pytest.mark.skipif(
                not multicast_works(), reason="this system has no multicast on 127.0.0.1"
            ),
        ),
    ],
)
def test_the_client_listens_where_the_server_says_it_sends(way):
    with linked({"data_port": None}, version="3.1", **way) as (_, client):
        frames(client, 3)


def test_two_clients_are_served_in_their_own_versions():
    with linked(version="4.3") as (motive, first), client_of(motive, bitstream="3.0") as second:
        assert motive.clients == 2
        for client, version in ((first, "4.3"), (second, "3.0")):
            frames(client, 5)
            assert str(client.version) == version
            assert client.statistics().malformed == 0


@pytest.mark.slow
@pytest.mark.parametrize("loss", [0.01, 0.1, 0.5])
def test_lost_frames_are_counted_and_the_others_used(loss):
    with linked(rate_hz=400.0) as (motive, client):
        frames(client, 5)
        motive.faults.loss = loss
        received = frames(client, 60)
        motive.faults.loss = 0.0
        received += frames(client, 2)
        numbers = {each.number for each in received}
        missing = max(numbers) - min(numbers) + 1 - len(numbers)
        assert client.statistics().lost >= missing
        assert missing > 0 or loss < 0.05
        assert client.statistics().malformed == 0


def test_frames_out_of_order_are_never_used():
    with linked(rate_hz=400.0) as (motive, client):
        motive.faults.reorder, motive.faults.duplicate = 3, 0.3
        received = frames(client, 80)
        numbers = [each.number for each in received]
        assert numbers == sorted(set(numbers))
        statistics = client.statistics()
        assert statistics.late > 0
        assert statistics.duplicates > 0
        assert statistics.sessions == 1


@pytest.mark.parametrize("fault", ["truncate", "wrong_size", "corrupt"])
def test_damaged_frames_are_refused_and_the_stream_goes_on(fault):
    with linked(rate_hz=400.0) as (motive, client):
        setattr(motive.faults, fault, 0.3)
        eventually(lambda: client.statistics().malformed > 10)
        setattr(motive.faults, fault, 0.0)
        frames(client, 10)
        eventually(lambda: client.newest().models is not None)


def test_a_frozen_stream_grows_old():
    with linked() as (motive, client):
        frames(client, 3)
        motive.faults.freeze = True
        eventually(lambda: client.statistics().duplicates > 2)
        frozen = client.newest()
        time.sleep(0.2)
        assert client.newest() is frozen
        assert client.newest().age() > 0.2
        assert client.statistics().duplicates > 5
        assert client.wait_next(frozen, 0.05) is None
        motive.faults.freeze = False
        assert client.wait_next(frozen, 2.0) is not None


@pytest.mark.slow
def test_a_restarted_server_is_found_again_in_unicast_and_multicast():
    for way in (WAYS[0], WAYS[2].values[0] if multicast_works() else WAYS[1]):
        with linked({"silence_s": 0.2}, **way) as (motive, client):
            frames(client, 70)
            motive.restart()
            eventually(lambda client=client: client.newest().session == 2)
            eventually(lambda client=client: client.newest().models is not None)
            eventually(lambda client=client: client.newest().exposure is not None)
            assert client.newest().age() < 1.0  # by the new clock


def test_changed_models_reach_the_client():
    with linked() as (motive, client):
        frames(client, 5)
        renamed = ["tail." + name.partition(".")[2] + name[1] for name in NAMES]
        motive.change_models(renamed)
        eventually(
            lambda: client.newest().models is not None and "tail.n11" in client.newest().models.labels()
        )
        assert client.statistics().model_updates >= 2


def test_names_can_be_waited_for():
    with linked() as (motive, client):
        motive.change_models([f"other.{name}" for name in NAMES])
        eventually(lambda: client.models is None or "other.m1.n1" in client.models.labels())
        assert "other.m1.n1" in client.wait_models().labels()
        eventually(lambda: not client.newest().data.has(MODELS_CHANGED))
        motive.faults.mute = True
        motive.change_models(NAMES)
        eventually(lambda: client.models is None)
        with pytest.raises(ServerSilentError, match="model definitions"):
            client.wait_models(timeout_s=0.1)


@pytest.mark.slow
def test_a_changed_version_is_followed():
    for options in ({}, {"multicast": True}) if multicast_works() else ({},):
        with linked(version="4.1", **options) as (motive, client):
            frames(client, 3)
            motive.change_version("3.0")
            eventually(lambda client=client: str(client.version) == "3.0")
            frames(client, 5)


def test_a_client_without_keep_alive_is_dropped_and_comes_back():
    with linked({"keep_alive_s": 60.0, "echo_s": 60.0}, keep_alive_timeout_s=0.2) as (motive, client):
        eventually(lambda: motive.clients == 0)
        eventually(lambda: motive.clients == 1)
        frames(client, 3)


def test_closing_says_goodbye_and_the_client_can_be_opened_again():
    with linked() as (motive, client):
        assert motive.clients == 1
        client.close()
        client.close()
        eventually(lambda: motive.clients == 0)
        client.open(timeout_s=5.0)
        frames(client, 3)
        with pytest.raises(RuntimeError, match="open already"):
            client.open()


def test_frames_that_nobody_drains_are_dropped_from_the_old_end():
    with linked(rate_hz=400.0) as (_, client):
        inbox, frame = client._inbox, frames(client, 1)[0]
        for _ in range(1500):
            inbox.put(frame)
        assert len(client.drain()) <= 1024
        assert client.statistics().queue_dropped >= 1500 - 1024


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), RuntimeError("a bug")])
def test_a_receiving_thread_that_ends_is_noticed_by_the_readers(error, monkeypatch):
    def fail(datagram, now):
        raise error

    with linked() as (_, client):
        last = frames(client, 1)[-1]
        monkeypatch.setattr(client._session, "receive", fail)
        eventually(lambda: client._inbox.failure is not None)
        for read in (client.newest, lambda: client.wait_next(last, 0.1), lambda: client.request("FrameRate")):
            with pytest.raises(HardwareError, match=r"Input/output error|a bug"):
                read()


def test_packets_of_another_computer_are_not_believed():
    with linked() as (motive, client):
        frames(client, 2)
        port = client._receiver._sockets.command.getsockname()[1]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.2", 0))
            stranger.sendto(motive.latest((4, 1)), ("127.0.0.1", port))
        eventually(lambda: client.statistics().foreign == 1)
        assert "127.0.0.2" in client.statistics().last_problem


@pytest.mark.slow
def test_a_second_source_of_frames_makes_both_doubtful_until_it_is_gone():
    """One port of the server's computer is its own; whoever sends from another may be anybody."""
    for way in ({"multicast": False}, {"multicast": True}):
        with linked(**way) as (motive, client):
            assert all(not frame.doubt for frame in frames(client, 5))
            motive.faults.second_source = 1.0
            eventually(lambda client=client: client.newest().doubt)
            client.drain()  # some are of before
            assert all(frame.doubt for frame in frames(client, 20))
            assert client.statistics().strangers >= 10
            assert "second source" in client.statistics().last_problem
            motive.faults.second_source = 0.0
            eventually(lambda client=client: not client.newest().doubt)


def test_one_frame_of_another_computer_is_not_used_and_makes_the_others_doubtful_for_a_moment():
    with linked() as (motive, client):
        last = frames(client, 2)[-1]
        port = client._receiver._sockets.command.getsockname()[1]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.2", 0))
            stranger.sendto(motive.latest((4, 1)), ("127.0.0.1", port))
        eventually(lambda: client.newest().doubt)
        eventually(lambda: not client.newest().doubt)
        assert client.newest().session == last.session
        assert client.statistics().strangers == 1


@pytest.mark.parametrize("way", [WAYS[0], WAYS[2]])
def test_names_from_another_program_of_the_servers_computer_are_not_believed(way):
    """Whoever may rename markers can turn a robot round without a wrong frame."""
    with linked(**way) as (_, client):
        frames(client, 2)
        eventually(lambda: client.models is not None)
        before = client.models.labels()
        sockets = client._receiver._sockets
        turned = wire.simple_models((4, 1), **{"m1": ["n2", "n3", "n1"], "m2": ["n1", "n2", "n3"]})
        said = [wire.packet(5, turned), wire.packet(1, wire.server_info((2, 9))), wire.packet(9)]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.1", 0))
            for packet in said:
                stranger.sendto(packet, ("127.0.0.1", sockets.command.getsockname()[1]))
            eventually(lambda: client.statistics().strangers == len(said))
        assert "a second server" in client.statistics().last_problem
        assert client.newest().doubt
        eventually(lambda: not client.newest().doubt)
        assert client.models.labels() == before
        assert frames(client, 2)


def test_a_server_that_comes_back_at_another_port_is_followed():
    senders = Senders()
    assert senders.admit(("10.0.0.1", 1511), 0.0)
    assert not senders.admit(("10.0.0.1", 4000), 0.5)
    assert senders.doubt(0.5)
    assert not senders.doubt(0.7)
    assert senders.admit(("10.0.0.1", 4000), 1.1)
    assert not senders.admit(("10.0.0.1", 1511), 1.2)


def test_a_stranger_that_goes_on_is_doubted_for_longer():
    senders = Senders()
    for k in range(40):
        senders.admit(("10.0.0.1", 1511), 0.1 * k)
        senders.admit(("10.0.0.1", 4000), 0.1 * k)
    assert senders.doubt(5.0)
    assert not senders.doubt(5.6)
    senders.admit(("10.0.0.1", 4000), 9.0)  # the first one has been silent for long: no stranger any more
    assert not senders.doubt(9.0)
