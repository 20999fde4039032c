"""Programs that we did not write, on the other side of the wire: three clients read what our emulated server sends.

Their known limits: ``natnet`` 0.3.0 reads 3.0 to 4.2, and from 4.1 on takes the seconds of the precision time stamp
for the flags; ``natnetsdk`` 4.1.1 (the vendor's sample) reads 3.x and 4.1 on, not 2.x and not 4.0; ``optirx`` 1.9
reads 2.x.
"""

from __future__ import annotations

import contextlib
import io
import socket
import struct
import time

import numpy as np
import pytest

from support import natnet_wire as wire
from tcr_hardware.emulators import motive_encoder as encoder
from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.motive_encoder import Stamp
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import TrackedMarkers
from tcr_hardware.emulators.motive_settings import MotiveSettings

NAMES = [f"m{i}.n{j}" for i in range(1, 14) for j in (1, 2, 3)]
POSITIONS = np.random.default_rng(4).normal(size=(39, 3))
AS_SENT = POSITIONS.astype(np.float32)
TRACKED = TrackedMarkers(NAMES, POSITIONS)
STAMP = Stamp(123, 0.5, 10_000, 20_000, 30_000, 2)
HIDDEN = MotiveFaults(occluded=frozenset(["m3.n2"]), missing=frozenset(["m1.n1"]))
ID_OF = {
    name: body.id << 16 | k + 1
    for body in TRACKED.bodies
    for k, name in enumerate(NAMES[i] for i in body.rows)
}


def sent(version, faults=None):
    payload = encoder.frame(version, STAMP, TRACKED, TRACKED.view(POSITIONS, faults or MotiveFaults()))
    return encoder.packet(7, payload)


# ---- natnet 0.3.0 ----


def natnet_frame(version, packet):
    natnet = pytest.importorskip("natnet", reason="the PyPI client natnet is not installed")
    from natnet.packet_buffer import PacketBuffer

    buffer = PacketBuffer(packet[4:])
    frame = natnet.DataFrame.read_from_buffer(buffer, natnet.Version(*version))
    return frame, len(buffer.data) - buffer.pointer


@pytest.mark.parametrize("version", [(3, 0), (3, 1), (4, 0), (4, 1), (4, 2)])
def test_natnet_reads_our_frames(version):
    frame, left = natnet_frame(version, sent(version, HIDDEN))
    unread = 4 + (8 if version >= (4, 1) else 0)  # end of data, and the precision time stamp it does not know
    assert left == unread
    assert frame.prefix.frame_number == 123
    assert {each.marker_id | each.model_id << 16: each.pos for each in frame.labeled_markers} == {
        ID_OF[name]: pytest.approx(AS_SENT[row]) for row, name in enumerate(NAMES) if name != "m1.n1"
    }
    assert [each.occluded for each in frame.labeled_markers].count(True) == 1
    assert [each.model_name for each in frame.marker_sets] == [f"m{i}" for i in range(1, 14)] + ["all"]
    assert [each.id_num for each in frame.rigid_bodies] == list(range(1, 14))
    assert [each.tracking_valid for each in frame.rigid_bodies] == [False, True, False] + [True] * 10
    suffix = frame.suffix
    ticks = (suffix.stamp_camera_mid_exposure, suffix.stamp_data_received, suffix.stamp_transmit)
    assert ticks == (10_000, 20_000, 30_000)
    assert suffix.timestamp == 0.5
    if version < (4, 1):
        assert suffix.tracked_models_changed


@pytest.mark.parametrize("version", [(3, 0), (3, 1), (4, 0), (4, 1), (4, 2)])
def test_natnet_reads_our_definitions(version):
    natnet = pytest.importorskip("natnet", reason="the PyPI client natnet is not installed")
    from natnet.packet_buffer import PacketBuffer

    buffer = PacketBuffer(encoder.models(version, TRACKED))
    models = natnet.DataDescriptions.read_from_buffer(buffer, natnet.Version(*version))
    assert buffer.pointer == len(buffer.data)
    assert [each.name for each in models.rigid_bodies] == [f"m{i}" for i in range(1, 14)]
    assert [each.name for each in models.marker_sets][-1] == "all"
    assert models.marker_sets[-1].marker_names == tuple(NAMES)
    if version >= (4, 0):
        assert [each.name for each in models.rigid_bodies[0].markers] == ["n1", "n2", "n3"]


def test_natnet_as_a_live_unicast_client_receives_our_stream():
    natnet = pytest.importorskip("natnet", reason="the PyPI client natnet is not installed")
    settings = MotiveSettings(command_port=0, version="4.0", rate_hz=200.0)
    with MotiveEmulator(NAMES, lambda: POSITIONS, settings) as motive:
        client = natnet.NatNetClient(
            "127.0.0.1", "127.0.0.1", command_port=motive.address[1], use_multicast=False
        )
        frames = []
        client.on_data_frame_received_event.handlers.append(frames.append)
        with client:
            assert client.server_info.application_name.startswith("Motive")
            end = time.monotonic() + 5.0
            while len(frames) < 5 and time.monotonic() < end:
                client.update_sync()
                time.sleep(0.01)
    assert len(frames) >= 5
    assert frames[0].labeled_markers[0].pos == pytest.approx(AS_SENT[0])


# ---- natnetsdk 4.1.1, the vendor's own sample ----


def vendor():
    sdk = pytest.importorskip("natnetsdk.NatNetClient", reason="the PyPI client natnetsdk is not installed")
    return sdk.NatNetClient()


@pytest.mark.parametrize("version", [(3, 0), (3, 1), (4, 1), (4, 2), (4, 3)])
def test_the_vendors_client_reads_our_frames(version):
    client, packet = vendor(), sent(version, HIDDEN)
    with contextlib.redirect_stdout(io.StringIO()):
        offset, data = client._NatNetClient__unpack_mocap_data(packet[4:], len(packet) - 4, *version)
    assert offset + 4 == len(packet) - 4  # it leaves the end of data
    markers = data.labeled_marker_data.labeled_marker_list
    assert {each.id_num: each.pos for each in markers} == {
        ID_OF[name]: pytest.approx(AS_SENT[row]) for row, name in enumerate(NAMES) if name != "m1.n1"
    }
    assert [each.param for each in markers].count(0x0B) == 1
    assert len(data.rigid_body_data.rigid_body_list) == 13
    assert data.marker_set_data.get_marker_set_count() == 14
    suffix = data.suffix_data
    assert (suffix.stamp_camera_mid_exposure, suffix.stamp_transmit, suffix.timestamp) == (
        10_000,
        30_000,
        0.5,
    )
    assert suffix.tracked_models_changed


@pytest.mark.parametrize("version", [(3, 0), (3, 1), (4, 0), (4, 1)])
def test_the_vendors_client_reads_our_definitions(version):
    client, payload = vendor(), encoder.models(version, TRACKED)
    with contextlib.redirect_stdout(io.StringIO()):
        offset, models = client._NatNetClient__unpack_data_descriptions(payload, len(payload), *version)
    assert offset == len(payload)
    assert len(models.rigid_body_list) == 13
    assert len(models.marker_set_list) == 14
    assert models.rigid_body_list[2].sz_name == b"m3"


def test_the_vendors_client_reads_our_server_info():
    client = vendor()
    info = encoder.server_info("Motive", (4, 1), 10_000_000, 1511, False, "239.255.42.99")
    with contextlib.redirect_stdout(io.StringIO()):
        client._NatNetClient__process_message(encoder.packet(1, info))
    assert client.get_application_name() == "Motive"
    assert client.get_nat_net_version_server() == [4, 1, 0, 0]


def test_the_vendors_requests_are_understood_by_our_server():
    """The very bytes of its CONNECT (271, one more than announced), REQUEST and KEEPALIVE."""
    client = vendor()
    with (
        MotiveEmulator(NAMES, lambda: POSITIONS, MotiveSettings(command_port=0, version="4.3")) as motive,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as command,
        contextlib.redirect_stdout(io.StringIO()),
    ):
        command.settimeout(5.0)
        client.send_request(command, client.NAT_CONNECT, "", motive.address)
        assert received(command, 1)[:7] == b"Motive "
        client.send_keep_alive(command, *motive.address)
        client.send_request(command, client.NAT_REQUEST, "Bitstream", motive.address)
        assert received(command, 3) == b"Bitstream,4.1\0"  # which its CONNECT had asked for
        client.send_request(command, client.NAT_REQUEST_MODELDEF, "", motive.address)
        assert received(command, 5) == encoder.models((4, 1), TRACKED)
        frame = received(command, 7)
        _, data = client._NatNetClient__unpack_mocap_data(frame, len(frame), 4, 1)
    assert len(data.labeled_marker_data.labeled_marker_list) == 39


def received(command, message):
    """Payload of the next packet of one kind."""
    for _ in range(100):
        packet = command.recv(65507)
        number, size = struct.unpack_from("<HH", packet)
        assert size == len(packet) - 4
        if number == message:
            return packet[4:]
    raise AssertionError(f"no message {message}")


# ---- optirx 1.9 ----


def optirx():
    return pytest.importorskip("optirx", reason="the PyPI client optirx is not installed")


@pytest.mark.parametrize("version", [(2, 5), (2, 7), (2, 9)])
def test_optirx_reads_our_frames(version):
    frame = optirx().unpack(sent(version, HIDDEN), (*version, 0, 0))
    assert frame.frameno == 123
    assert frame.latency == pytest.approx(0.5)  # its name for what is a time
    if version >= (2, 7):
        assert (frame.timestamp, frame.tracked_models_changed) == (0.5, True)
        assert [each.occluded for each in frame.labeled_markers].count(True) == 1
        assert [each.tracking_valid for each in frame.rigid_bodies].count(False) == 2
    assert {each.id: each.position for each in frame.labeled_markers} == {
        ID_OF[name]: pytest.approx(AS_SENT[row]) for row, name in enumerate(NAMES) if name != "m1.n1"
    }
    assert len(frame.rigid_bodies[4].markers) == 3
    assert frame.sets[b"all"][20] == pytest.approx(AS_SENT[20])


def test_optirx_reads_our_server_info():
    packet = encoder.packet(1, encoder.server_info("Motive", (2, 9), 0, 1511, True, "239.255.42.99"))
    assert optirx().unpack(packet, (2, 9, 0, 0)) == (b"Motive", (3, 1, 0, 0), (2, 9, 0, 0))


# ---- the encoder of the tests ----


@pytest.mark.parametrize("version", wire.VERSIONS)
def test_our_server_and_the_encoder_of_the_tests_write_the_same_bytes(version):
    view = TRACKED.view(POSITIONS, HIDDEN)
    lost = POSITIONS.copy()
    lost[0] = 0.0
    content = wire.Wire(
        number=123,
        sets=[(body.name, lost[body.rows]) for body in TRACKED.bodies] + [("all", lost)],
        bodies=[
            (
                body.id,
                p,
                q,
                encoder.RESIDUAL,
                int(t),
                [(lost[row], k + 1, 0.008) for k, row in enumerate(body.rows)],
            )
            for body, p, q, t in zip(
                TRACKED.bodies, view.body_positions, view.body_orientations, view.body_tracked, strict=True
            )
        ],
        markers=[
            (ID_OF[name], POSITIONS[row], 0.008, 0x0B if name == "m3.n2" else 0x0A, encoder.RESIDUAL)
            for row, name in enumerate(NAMES)
            if name != "m1.n1"
        ],
        latency=0.5,
        timestamp=0.5,
        ticks=(10_000, 20_000, 30_000),
        params=2,
    )
    assert sent(version, HIDDEN)[4:] == wire.frame_payload(version, content)
