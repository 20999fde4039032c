"""The conversation with a server as laws, with time and network in the hands of the test."""

from __future__ import annotations

import struct

import pytest

from support import natnet_wire as wire
from support.natnet_wire import VERSIONS, Wire
from tcr_hardware.natnet.errors import UnsupportedVersionError
from tcr_hardware.natnet.session import MALFORMED_IN_A_ROW, Session
from tcr_hardware.natnet.settings import NatNetSettings

HZ = 10_000_000
(CONNECT, SERVERINFO, REQUEST, RESPONSE, REQUEST_MODELDEF, MODELDEF, _, FRAME) = range(8)
DISCONNECT, KEEPALIVE, BYTIMEOUT, ECHO, ECHOED, UNRECOGNIZED = 9, 10, 11, 12, 13, 100
UNICAST, MULTICAST = NatNetSettings(multicast=False), NatNetSettings(multicast=True)


class Server:
    """A scripted server: answers what a session sends; its clock is ours plus an offset."""

    def __init__(self, version=(4, 1), *, own=None, bitstream=True, models=None):
        self.own, self.version, self.bitstream = own or version, version, bitstream
        self.models = models or {"m1": ["n1", "n2", "n3"]}
        self.asked = []
        self.number = 0
        self.clock_offset = 1000.0

    def answers(self, datagram, now):
        message, _ = struct.unpack_from("<HH", datagram)
        payload = datagram[4:]
        self.asked.append(message if message != REQUEST else payload.rstrip(b"\0").decode())
        if message == CONNECT:
            return [wire.packet(SERVERINFO, wire.server_info(self.own))]
        if message == REQUEST_MODELDEF:
            return [wire.packet(MODELDEF, wire.simple_models(self.version, **self.models))]
        if message == ECHO:
            return [wire.packet(ECHOED, payload + struct.pack("<Q", round((now + self.clock_offset) * HZ)))]
        if message == REQUEST and payload.startswith(b"Bitstream"):
            return self.on_bitstream(payload.rstrip(b"\0").decode().partition(",")[2])
        return []

    def on_bitstream(self, wanted):
        if not self.bitstream:
            return [wire.packet(UNRECOGNIZED, wire.server_info((2, 9)))]
        if wanted:
            self.version = tuple(int(part) for part in wanted.split("."))
            return [wire.packet(RESPONSE, b"\0\0\0\0")]
        return [wire.packet(RESPONSE, b"Bitstream,%d.%d\0" % self.version)]

    def frame(self, now, *, number=None, params=0, version=None):
        self.number = self.number + 1 if number is None else number
        ticks = tuple(round((now - late + self.clock_offset) * HZ) for late in (0.003, 0.001, 0.0))
        content = Wire(
            number=self.number, markers=[(1 << 16 | 1, (1, 2, 3), 0.01, 10, 0.0)], ticks=ticks, params=params
        )
        return wire.packet(FRAME, wire.frame_payload(version or self.version, content))


def talk(session, server, now, seconds=0.6, step=0.05):
    """Let both exchange requests and answers; return the time after it."""
    end = now + seconds
    while now < end:
        for datagram in session.due(now):
            for answer in server.answers(datagram, now):
                session.receive(answer, now + 0.0002)
        now += step
    return now


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("settings", [UNICAST, MULTICAST])
def test_a_session_gets_ready_with_every_version(version, settings):
    session, server = Session(settings, 0.0), Server(version)
    now = talk(session, server, 0.0)
    assert session.ready
    assert session.version == version
    frame = session.receive(server.frame(now), now)
    assert frame.models.labels() == {"m1.n1": 65537, "m1.n2": 65538, "m1.n3": 65539}
    assert (frame.sequence, frame.session, frame.arrival) == (0, 1, now)
    if version >= (3, 0):
        assert frame.exposure == pytest.approx(now - 0.003, abs=2e-4)
        assert frame.taken_at == frame.exposure
        assert frame.software_latency == pytest.approx(0.001, abs=1e-6)
        assert frame.age(now + 1.0) == pytest.approx(1.003, abs=2e-4)
    else:
        assert frame.exposure is None


def test_only_unicast_keeps_alive_and_asks_for_the_bit_stream():
    for settings, expected in ((UNICAST, True), (MULTICAST, False)):
        session, server = Session(settings, 0.0), Server((4, 1))
        talk(session, server, 0.0, seconds=3.2)
        assert (server.asked.count(KEEPALIVE) >= 3) == expected
        assert ("Bitstream" in server.asked) == expected
        assert server.asked.count(ECHO) == pytest.approx(3.2 / 0.25, abs=2)


def test_the_version_asked_for_is_the_version_read():
    session = Session(NatNetSettings(multicast=False, bitstream="3.1"), 0.0)
    server = Server((4, 3))
    now = talk(session, server, 0.0)
    assert server.version == session.version == (3, 1)
    assert session.receive(server.frame(now), now) is not None


def test_a_server_newer_than_the_client_is_asked_for_4_1_in_unicast():
    session, server = Session(UNICAST, 0.0), Server((4, 5))
    talk(session, server, 0.0)
    assert session.version == (4, 1)
    assert session.failure is None


@pytest.mark.parametrize(
    ("settings", "version"),
    [
        (MULTICAST, (4, 5)),
        (MULTICAST, (5, 0)),
        (MULTICAST, (2, 4)),
        (UNICAST, (2, 4)),
        (NatNetSettings(multicast=True, bitstream="4.1"), (4, 3)),
        (NatNetSettings(multicast=False, bitstream="3.0"), (3, 1)),
    ],
)
def test_versions_that_cannot_be_read_are_refused_by_name(settings, version):
    session, server = Session(settings, 0.0), Server(version)
    talk(session, server, 0.0)
    assert isinstance(session.failure, UnsupportedVersionError)
    assert "{}.{}".format(*version) in str(session.failure)
    assert session.failure.hint


def test_a_newer_version_is_read_when_allowed():
    session = Session(NatNetSettings(multicast=True, allow_newer=True), 0.0)
    server = Server((4, 5))
    now = talk(session, server, 0.0)
    assert session.version == (4, 5)
    assert session.receive(server.frame(now, version=(4, 3)), now) is not None


def test_a_server_that_does_not_know_bit_streams_streams_its_own():
    session, server = Session(UNICAST, 0.0), Server((4, 0), bitstream=False)
    talk(session, server, 0.0)
    assert session.version == (4, 0)


def test_a_server_that_refuses_the_version_asked_for_is_an_error():
    session = Session(NatNetSettings(multicast=False, bitstream="4.1"), 0.0)
    talk(session, Server((4, 2), bitstream=False), 0.0)
    assert isinstance(session.failure, UnsupportedVersionError)


def test_a_server_that_never_answers_about_the_bit_stream_is_believed():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    server.on_bitstream = lambda wanted: []
    talk(session, server, 0.0, seconds=2.0)
    assert session.version == (4, 1)


def test_frames_before_the_server_told_its_version_are_counted_and_dropped():
    session, server = Session(MULTICAST, 0.0), Server((3, 0))
    assert session.receive(server.frame(0.0), 0.0) is None
    assert (session.early, session.malformed, session.frames) == (1, 0, 0)
    now = talk(session, server, 0.0)
    assert session.receive(server.frame(now), now) is not None


def test_changed_models_take_the_names_away_until_they_are_told_anew():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    before = session.receive(server.frame(now), now)
    server.models = {"tail": ["a"], "m1": ["n1", "n2", "n3"]}
    changed = [session.receive(server.frame(now, params=2), now) for _ in range(3)]
    assert [frame.models for frame in changed] == [None] * 3
    now = talk(session, server, now)
    after = session.receive(server.frame(now, params=2), now)  # the flag may still be set
    assert before.models.labels()["m1.n1"] == 1 << 16 | 1
    assert after.models.labels()["m1.n1"] == 2 << 16 | 1
    assert session.model_updates == 2


def test_names_that_change_twice_while_the_flag_is_up_are_asked_for_again_at_its_end():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    session.receive(server.frame(now, params=2), now)
    now = talk(session, server, now)
    server.models = {"second": ["a"]}
    session.receive(server.frame(now, params=2), now)
    now = talk(session, server, now)
    assert "second.a" not in session.models.labels()
    session.receive(server.frame(now), now)
    assert session.models is not None
    now = talk(session, server, now)
    assert "second.a" in session.models.labels()
    asked = server.asked.count(REQUEST_MODELDEF)
    talk(session, server, now)
    assert server.asked.count(REQUEST_MODELDEF) == asked


def test_a_restarted_server_is_a_new_session_with_new_names_and_a_new_clock():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    session.receive(server.frame(now, number=5000), now)
    frame = session.receive(server.frame(now + 2.0, number=0), now + 2.0)
    assert frame.session == 2
    assert frame.models is None
    assert frame.exposure is None
    now = talk(session, server, now + 2.0)
    frame = session.receive(server.frame(now), now)
    assert frame.exposure == pytest.approx(now - 0.003, abs=2e-4)
    assert frame.models is not None


def test_a_restart_that_the_numbers_hide_shows_in_the_clock():
    """The new count has just reached the old one when we hear of it again."""
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    session.receive(server.frame(now, number=70), now)
    server.clock_offset += 500.0
    assert session.receive(server.frame(now, number=71), now).session == 1
    now = talk(session, server, now)
    assert session.clock.steps == 1
    frame = session.receive(server.frame(now, number=72), now)
    assert (frame.session, frame.models) == (2, None)
    now = talk(session, server, now)
    frame = session.receive(server.frame(now), now)
    assert frame.exposure == pytest.approx(now - 0.003, abs=2e-4)
    assert session.order.lost == 0


def test_silence_makes_the_client_connect_again():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    session.receive(server.frame(now), now)
    connects = server.asked.count(CONNECT)
    talk(session, server, now, seconds=0.9)
    assert server.asked.count(CONNECT) == connects
    talk(session, server, now + 0.9, seconds=3.0)
    assert connects + 2 <= server.asked.count(CONNECT) <= connects + 4


@pytest.mark.parametrize("word", [DISCONNECT, BYTIMEOUT])
def test_a_server_that_ended_the_connection_is_connected_at_once(word):
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    session.receive(wire.packet(word), now)
    connects = server.asked.count(CONNECT)
    now = talk(session, server, now, seconds=0.3)
    assert server.asked.count(CONNECT) == connects + 1
    assert session.receive(server.frame(now), now) is not None


def test_a_version_that_changes_in_mid_stream_is_found_out():
    """Announced by flag where it is agreed upon; without a word in multicast, where only the packets tell."""
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    server.version = (3, 0)
    session.receive(server.frame(now, params=8, version=(4, 1)), now)
    now = talk(session, server, now)
    assert session.version == (3, 0)

    session, server = Session(MULTICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    server.own = server.version = (3, 0)
    for _ in range(MALFORMED_IN_A_ROW):
        assert session.receive(server.frame(now), now) is None
    assert session.malformed == MALFORMED_IN_A_ROW
    now = talk(session, server, now)
    assert session.receive(server.frame(now), now) is not None
    assert session.version == (3, 0)


def test_malformed_packets_leave_the_session_as_it_was():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    good = server.frame(now)
    for broken in (
        good[:50],
        good[:-1],
        b"",
        b"\7\0",
        wire.packet(FRAME),
        wire.packet(MODELDEF, b"\xff" * 9),
    ):
        assert session.receive(broken, now) is None
        session._in_a_row = 0
    assert session.receive(good, now) is not None
    assert session.malformed == 6
    assert session.models.labels()
    assert "malformed" in session.last_problem


def test_an_echo_that_nobody_asked_for_does_not_set_the_clock():
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    best = session.clock.best
    for client_ns in (0, 2**64 - 1, round((now + 5.0) * 1e9)):
        session.receive(wire.packet(ECHOED, struct.pack("<QQ", client_ns, 5)), now)
    assert session.clock.best is best
    assert session.clock.steps == 0


@pytest.mark.parametrize("exposed_s_ago", [-0.01, -1e6, 11.0, 900.0])
def test_a_frame_from_an_impossible_time_is_dated_by_its_arrival(exposed_s_ago):
    """A wrong stamp must not make an old frame look fresh."""
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    ticks = round((now - exposed_s_ago + 1000.0) * HZ)
    content = Wire(number=1, ticks=(max(ticks, 1), 5, 5))
    frame = session.receive(wire.packet(FRAME, wire.frame_payload((4, 1), content)), now)
    assert frame.exposure is None
    assert frame.age(now) == 0.0
    assert session.impossible == 1


@pytest.mark.parametrize("field", [775.3, 3427.1, 98527.4, 0.02, -1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("version", [each for each in VERSIONS if each < (3, 0)])
def test_the_age_of_an_old_servers_frame_counts_from_its_arrival(version, field):
    """What the vendor's headers call a latency is a time stamp, in real frames of 2.5, 2.7 and 2.9."""
    session, server = Session(UNICAST, 0.0), Server(version)
    now = talk(session, server, 0.0)
    content = Wire(number=1, latency=field, timestamp=field)
    frame = session.receive(wire.packet(FRAME, wire.frame_payload(version, content)), now)
    assert frame.age(now + 0.03) == pytest.approx(0.03)
    assert (frame.software_latency, session.impossible) == (None, 0)


@pytest.mark.parametrize(("received", "transmit"), [(5, 4), (1, 2**63), (2**63, 1)])
def test_a_frame_that_was_at_the_server_for_an_impossible_time_is_dated_by_its_arrival(received, transmit):
    session, server = Session(UNICAST, 0.0), Server((4, 1))
    now = talk(session, server, 0.0)
    content = Wire(number=1, ticks=(0, received, transmit))
    frame = session.receive(wire.packet(FRAME, wire.frame_payload((4, 1), content)), now)
    assert (frame.software_latency, frame.age(now)) == (None, 0.0)
    assert session.impossible == 1


def test_a_message_of_the_server_is_shown():
    session = Session(UNICAST, 0.0)
    session.receive(wire.packet(8, b"hard drive full\0junk"), 0.0)
    assert session.last_problem == "server: hard drive full"
