"""The emulated Motive server, seen through bare sockets: it answers what real clients send, and fails on demand."""

from __future__ import annotations

import socket
import struct
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import OCCLUDED, SEEN, UNLABELLED, TrackedMarkers
from tcr_hardware.emulators.motive_outbox import Outbox
from tcr_hardware.emulators.motive_settings import MotiveSettings

NAMES = ["m1.n1", "m1.n2", "m1.n3", "m2.n1", "m2.n2", "m2.n3", "m2.apex", "tip"]
POSITIONS = np.random.default_rng(2).normal(size=(8, 3))


def serve(**options):
    return MotiveEmulator(NAMES, lambda: POSITIONS, MotiveSettings(**{"command_port": 0, **options}))


def ask(command, motive, datagram, wanted):
    """Send a request; return the payload of the first answer of one kind."""
    command.settimeout(5.0)
    command.sendto(datagram, motive.address)
    for _ in range(1000):
        packet = command.recv(65507)
        message, size = struct.unpack_from("<HH", packet)
        assert size == len(packet) - 4
        if message == wanted:
            return packet[4:]
    raise AssertionError(f"no message {wanted}")


def eventually(condition, timeout_s=5.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def packet(message, payload=b""):
    return struct.pack("<HH", message, len(payload)) + payload


@pytest.fixture
def command():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        yield udp


CONNECTS = {
    "empty": b"",
    "ping": b"Ping\0",
    "sender": bytes(264),
    "options": bytes(265) + bytes((3, 1, 0, 0)),
    "padded": bytes(265) + bytes((3, 1, 0, 0)) + bytes(2),
}


@pytest.mark.parametrize("form", CONNECTS)
def test_every_form_of_connect_is_answered_and_streamed_to(form, command):
    with serve() as motive:
        info = ask(command, motive, packet(0, CONNECTS[form]), 1)
        assert info.startswith(b"Motive")
        assert info[260:264] == bytes((4, 1, 0, 0))
        assert motive.clients == 1
        ask(command, motive, packet(10), 7)
        stream = ask(command, motive, packet(2, b"Bitstream\0"), 3)
        assert stream == (b"Bitstream,3.1\0" if form in ("options", "padded") else b"Bitstream,4.1\0")


def test_discovery_is_answered_without_streaming(command):
    with serve() as motive:
        ask(command, motive, packet(14, bytes(264)), 1)
        assert motive.clients == 0


def test_a_single_frame_can_be_asked_for(command):
    with serve(rate_hz=0.01) as motive:
        frame = ask(command, motive, packet(6), 7)
        assert struct.unpack_from("<i", frame)[0] >= 0


def test_what_no_server_knows_is_said_to_be_unrecognized(command):
    with serve() as motive:
        for request in (packet(2, b"Bake,Cake\0"), packet(2, b"Bitstream,x.y\0"), packet(77)):
            assert ask(command, motive, request, 100).startswith(b"Motive")
        command.sendto(b"\1", motive.address)  # not even a header
        assert ask(command, motive, packet(2, b"UnitsToMillimeters\0"), 3) == struct.pack("<f", 1000.0)


def test_the_server_clock_runs_with_its_offset_and_drift(command):
    with serve(clock_offset_s=500.0, clock_drift=1e-3) as motive:
        before = time.monotonic()
        client, ticks = struct.unpack("<QQ", ask(command, motive, packet(12, struct.pack("<Q", 42)), 13))
        after = time.monotonic()
        assert client == 42
        assert (before + 500.0) * 1.001 <= ticks / 10_000_000 <= (after + 500.0) * 1.001


def test_a_silent_client_is_told_that_it_was_dropped(command):
    with serve(keep_alive_timeout_s=0.1) as motive:
        ask(command, motive, packet(0), 1)
        assert ask(command, motive, b"", 11) == b""
        assert motive.clients == 0


def test_a_client_that_says_goodbye_gets_nothing_more(command):
    with serve() as motive:
        ask(command, motive, packet(0), 1)
        command.sendto(packet(9), motive.address)
        eventually(lambda: motive.clients == 0)


def test_an_error_of_the_positions_is_raised_when_the_server_is_stopped():
    shown = iter([POSITIONS])
    motive = MotiveEmulator(NAMES, lambda: next(shown), MotiveSettings(command_port=0, rate_hz=1000.0))
    motive.start()
    eventually(lambda: motive.failure is not None)
    with pytest.raises(StopIteration):
        motive.stop()


def test_what_cannot_be_served_is_refused():
    with pytest.raises(ValueError, match="8 names, but positions of shape"):
        MotiveEmulator(NAMES, lambda: POSITIONS[:5], MotiveSettings(command_port=0))
    for wrong in ({"unicast_to": "nobody"}, {"version": "four"}, {"rate_hz": 0.0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            serve(**wrong)


# ---- what is tracked ----


def look(**faults):
    tracked = TrackedMarkers(NAMES, POSITIONS)
    return tracked, tracked.view(POSITIONS, MotiveFaults(**faults))


def test_bodies_are_named_by_the_first_part_of_the_marker_names():
    tracked, view = look()
    assert [(body.name, body.markers) for body in tracked.bodies] == [
        ("m1", ("n1", "n2", "n3")),
        ("m2", ("n1", "n2", "n3", "apex")),
        ("markers", ("tip",)),
    ]
    assert view.ids.tolist() == [65537, 65538, 65539, 131073, 131074, 131075, 131076, 196609]
    assert view.body_positions[1] == pytest.approx(POSITIONS[3:7].mean(axis=0))
    assert view.body_tracked.all()


def test_the_orientation_of_a_body_is_its_rotation_since_it_was_defined():
    tracked = TrackedMarkers(NAMES, POSITIONS)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])
    view = tracked.view(turn.apply(POSITIONS) + 5.0, MotiveFaults())
    assert view.body_orientations[:2] == pytest.approx(np.tile(turn.as_quat(), (2, 1)))
    assert view.body_orientations[2].tolist() == [0, 0, 0, 1]  # one marker has no orientation


def test_both_forms_of_dropout_are_shown():
    _, view = look(occluded=frozenset(["m1.n2"]), missing=frozenset(["m2.n3"]))
    assert 131075 not in view.ids
    assert view.params[view.ids == 65538] == OCCLUDED
    assert (view.params[view.ids != 65538] == SEEN).all()
    assert view.positions[view.ids == 65538][0] == pytest.approx(POSITIONS[1])
    assert view.body_tracked.tolist() == [False, False, True]
    assert len(view.in_sets) == 8


def test_faults_of_position_are_shown():
    _, view = look(nan=frozenset(["tip"]), swap=(("m1.n1", "m2.apex"),), offset_m=(1.0, 0.0, 0.0))
    at = dict(zip(view.ids.tolist(), view.positions, strict=True))
    assert np.isnan(at[196609]).all()
    assert at[65537] == pytest.approx(POSITIONS[6] + [1, 0, 0])
    assert at[131076] == pytest.approx(POSITIONS[0] + [1, 0, 0])
    _, view = look(untracked=True)
    assert not view.body_tracked.any()


def test_markers_without_names_are_a_cloud_of_points():
    _, view = look(unlabelled=True, missing=frozenset(["tip"]))
    assert len(view.unlabelled) == 7
    assert (view.params == UNLABELLED).all()
    assert sorted(map(tuple, view.unlabelled)) == sorted(map(tuple, POSITIONS[:7]))
    assert not view.body_tracked.any()


# ---- the way out ----


def sent(n=2000, **faults):
    outbox, out = Outbox(seed=1), []
    for k in range(n):
        outbox.put(struct.pack("<HHI", 7, 4, k), ("", 0), 0.01 * k, 0.01, MotiveFaults(**faults))
    outbox.flush(1e9, lambda datagram, destination: out.append(datagram))
    return out


def test_the_outbox_loses_repeats_and_reorders_in_the_shares_asked_for():
    numbers = [struct.unpack("<HHI", datagram)[2] for datagram in sent()]
    assert numbers == list(range(2000))
    assert len(sent(loss=0.1)) == pytest.approx(1800, abs=60)
    assert len(sent(duplicate=0.1)) == pytest.approx(2200, abs=60)
    numbers = [struct.unpack("<HHI", datagram)[2] for datagram in sent(reorder=3)]
    assert sorted(numbers) == list(range(2000))
    assert numbers != sorted(numbers)
    assert max(abs(k - number) for k, number in enumerate(numbers)) <= 3


def test_the_outbox_damages_in_the_shares_asked_for():
    whole = set(sent())
    assert sum(d in whole for d in sent(corrupt=0.2)) == pytest.approx(1600, abs=80)
    assert sum(len(d) < 8 for d in sent(truncate=0.2)) == pytest.approx(400, abs=80)
    assert sum(d[2:4] != b"\4\0" for d in sent(wrong_size=0.2)) == pytest.approx(400, abs=80)


def test_delayed_frames_leave_later():
    outbox, out = Outbox(seed=1), []
    outbox.put(b"a", ("", 0), 1.0, 0.01, MotiveFaults(delay_s=0.5))
    outbox.flush(1.4, lambda datagram, destination: out.append(datagram))
    assert out == []
    assert outbox.next_due() == 1.5
    outbox.flush(1.5, lambda datagram, destination: out.append(datagram))
    assert out == [b"a"]
    assert outbox.next_due() == float("inf")
