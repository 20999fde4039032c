"""Frames and model definitions of every version decode exactly; nothing else decodes at all."""

from __future__ import annotations

import contextlib
import random
import struct
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support import natnet_wire as wire
from support.natnet_wire import VERSIONS, Wire
from tcr_hardware.natnet.errors import MalformedPacketError
from tcr_hardware.natnet.frame import MARKER, MODELS_CHANGED, RECORDING, RIGID_BODY
from tcr_hardware.natnet.frame_decoder import decode_frame
from tcr_hardware.natnet.model_decoder import decode_models
from tcr_hardware.natnet.protocol import Version

# The same small frame in every version, written out by hand: number 7; marker set "A" with (1, 2, 3); unlabelled
# point (4, 5, 6); body 9 at (1, 2, 3) without rotation, error 0.5, tracked, one marker; labelled marker (1, 2).
SET = "4100010000000000803f0000004000004040"
POINT = "000080400000a0400000c040"
POSE = "090000000000803f00000040000040400000000000000000000000000000803f"
BODY_MARKERS = "010000000000803f0000004000004040030000000ad7233c"
MARKER_20 = "020001000000803f00000040000040400ad7233c"
TICKS = "010000000000000002000000000000000300000000000000"
STAMP = "000000000000e03f"  # 0.5 s
N1, N0, CODE, END = "01000000", "00000000", "0a0000000b000000", "00000000"
HALF = "0000003f"

GOLDEN = {
    (2, 5): [N1, SET, N1, POINT, N1, POSE, BODY_MARKERS, HALF, N0, N1, MARKER_20, HALF, CODE, END],
    (2, 6): [
        N1, SET, N1, POINT, N1, POSE, BODY_MARKERS, HALF, "0100", N0, N1, MARKER_20, "0a00",
        HALF, CODE, HALF, "0100", END,
    ],
    (2, 7): [
        N1, SET, N1, POINT, N1, POSE, BODY_MARKERS, HALF, "0100", N0, N1, MARKER_20, "0a00",
        HALF, CODE, STAMP, "0100", END,
    ],
    (2, 9): [
        N1, SET, N1, POINT, N1, POSE, BODY_MARKERS, HALF, "0100", N0, N1, MARKER_20, "0a00",
        N0, HALF, CODE, STAMP, "0100", END,
    ],
    (2, 10): [
        N1, SET, N1, POINT, N1, POSE, BODY_MARKERS, HALF, "0100", N0, N1, MARKER_20, "0a00",
        N0, HALF, CODE, STAMP, "0100", END,
    ],
    (3, 0): [
        N1, SET, N1, POINT, N1, POSE, HALF, "0100", N0, N1, MARKER_20, "0a00", HALF,
        N0, N0, CODE, STAMP, TICKS, "0100", END,
    ],
    (4, 1): [
        N1, "12000000", SET, N1, "0c000000", POINT, N1, "26000000", POSE, HALF, "0100", N0, N0, N0, N0,
        N1, "1a000000", MARKER_20, "0a00", HALF, N0, N0, N0, N0,
        CODE, STAMP, TICKS, "04000000" "05000000", "0100", END,
    ],
}  # fmt: skip
GOLDEN[(3, 1)] = GOLDEN[(4, 0)] = GOLDEN[(3, 0)]
GOLDEN[(4, 2)] = GOLDEN[(4, 3)] = GOLDEN[(4, 4)] = GOLDEN[(4, 1)]


@pytest.mark.parametrize("version", VERSIONS)
def test_the_golden_frame_of_every_version_is_read_to_the_last_byte(version):
    frame = decode_frame(bytes.fromhex("07000000" + "".join(GOLDEN[version])), Version(*version))
    assert frame.number == 7
    assert frame.marker_sets[0].name == "A"
    assert frame.marker_sets[0].positions.tolist() == [[1, 2, 3]]
    assert frame.unlabelled.tolist() == [[4, 5, 6]]
    body, marker = frame.rigid_bodies[0], frame.markers[0]
    assert (body["id"], body["position"].tolist(), body["orientation"].tolist()) == (
        9,
        [1, 2, 3],
        [0, 0, 0, 1],
    )
    assert body["mean_error"] == 0.5
    assert (marker["id"], marker["position"].tolist(), marker["size"]) == (65538, [1, 2, 3], np.float32(0.01))
    assert (body["params"], marker["params"]) == ((1, 10) if version >= (2, 6) else (0, 0))
    assert marker["residual"] == (0.5 if version >= (3, 0) else 0.0)
    suffix = frame.suffix
    assert suffix.timecode == (10, 11)
    assert suffix.timestamp == (0.5 if version >= (2, 6) else None)
    assert suffix.software_latency == (0.5 if version < (3, 0) else None)
    ticks = (suffix.mid_exposure, suffix.received, suffix.transmit)
    assert ticks == ((1, 2, 3) if version >= (3, 0) else (0, 0, 0))
    assert suffix.precision == ((4, 5) if version >= (4, 1) else (0, 0))
    assert frame.has(RECORDING) == (version >= (2, 6))
    assert not frame.has(MODELS_CHANGED)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_encoder_of_the_tests_writes_the_golden_frame(version):
    content = Wire(
        sets=[("A", [(1, 2, 3)])],
        unlabelled=[(4, 5, 6)],
        bodies=[(9, (1, 2, 3), (0, 0, 0, 1), 0.5, 1, [((1, 2, 3), 3, 0.01)])],
        markers=[(65538, (1, 2, 3), 0.01, 10, 0.5)],
        latency=0.5,
        timecode=(10, 11),
        timestamp=0.5,
        ticks=(1, 2, 3),
        precision=(4, 5),
        params=1,
    )
    assert wire.frame_payload(version, content).hex() == "07000000" + "".join(GOLDEN[version])


def f32(values):
    return np.array(values, "<f4").tolist()


def as_sent(version, content):
    """What is left of a frame once it was packed for a version."""
    flags, full = version >= (2, 6), version >= (3, 0)

    def bodies(sent):
        return [(b[0], f32(b[1]), f32(b[2]), f32(b[3]), b[4] if flags else 0) for b in sent]

    def markers(sent):
        return [(m[0], f32(m[1]), f32(m[2]), m[3] * flags, f32(m[4]) if full else 0.0) for m in sent]

    def analog(sent):
        return [(number, [f32(samples) for samples in channels]) for number, channels in sent]

    stamp = content.timestamp if version >= (2, 7) else f32(content.timestamp) if flags else None
    return Wire(
        number=content.number,
        sets=[(name, f32(points)) for name, points in content.sets],
        unlabelled=f32(content.unlabelled),
        bodies=bodies(content.bodies),
        skeletons=[(number, bodies(of)) for number, of in content.skeletons],
        assets=[(n, bodies(b), markers(m)) for n, b, m in content.assets] if version >= (4, 1) else [],
        markers=markers(content.markers),
        plates=analog(content.plates) if version >= (2, 9) else [],
        devices=analog(content.devices) if version >= (2, 11) else [],
        latency=None if full else f32(content.latency),
        timecode=content.timecode,
        timestamp=stamp,
        ticks=content.ticks if full else (0, 0, 0),
        precision=content.precision if version >= (4, 1) else (0, 0),
        params=content.params if flags else 0,
    )


def as_read(frame):
    """A decoded frame as plain numbers."""

    def plain(records):
        return [tuple(np.asarray(each[name]).tolist() for name in records.dtype.names) for each in records]

    def analog(section):
        return [(each.id, [samples.tolist() for samples in each.channels]) for each in section]

    assert frame.markers.dtype == MARKER
    assert frame.rigid_bodies.dtype == RIGID_BODY
    suffix = frame.suffix
    return Wire(
        number=frame.number,
        sets=[(each.name, each.positions.tolist()) for each in frame.marker_sets],
        unlabelled=frame.unlabelled.tolist(),
        bodies=plain(frame.rigid_bodies),
        skeletons=[(each.id, plain(each.rigid_bodies)) for each in frame.skeletons],
        assets=[(each.id, plain(each.rigid_bodies), plain(each.markers)) for each in frame.assets],
        markers=plain(frame.markers),
        plates=analog(frame.force_plates),
        devices=analog(frame.devices),
        latency=suffix.software_latency,
        timecode=suffix.timecode,
        timestamp=suffix.timestamp,
        ticks=(suffix.mid_exposure, suffix.received, suffix.transmit),
        precision=suffix.precision,
        params=suffix.params,
    )


@pytest.mark.slow
@settings(max_examples=150)
@given(seed=st.integers(0, 2**32 - 1), version=st.sampled_from(VERSIONS))
def test_what_an_independent_encoder_writes_is_read_back_unchanged(seed, version):
    content = wire.random_frame(random.Random(seed))
    frame = decode_frame(wire.frame_payload(version, content), Version(*version))
    assert as_read(frame) == as_sent(version, content)
    markers = [
        (each.positions.tolist(), each.ids.tolist(), each.sizes.tolist()) for each in frame.body_markers
    ]
    sent = [
        [list(column) for column in zip(*body[5], strict=True)] or [[], [], []] for body in content.bodies
    ]
    assert markers == ([(f32(xyz), ids, f32(sizes)) for xyz, ids, sizes in sent] if version < (3, 0) else [])


def full_frame(version):
    """One of everything."""
    a_body = (1, (1, 2, 3), (0, 0, 0, 1), 0.1, 1, [((1, 2, 3), 1, 0.01)] * 3)
    a_marker = (65537, (1, 2, 3), 0.01, 10, 0.001)
    return wire.frame_payload(
        version,
        Wire(
            sets=[("base", [(1, 2, 3)] * 3), ("all", [(1, 2, 3)] * 6)],
            unlabelled=[(1, 2, 3)],
            bodies=[a_body, a_body],
            skeletons=[(5, [a_body])],
            assets=[(6, [a_body], [a_marker])],
            markers=[a_marker] * 6,
            plates=[(1, [[1.0, 2.0]])],
            devices=[(2, [[1.0], [2.0]])],
        ),
    )


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_a_frame_cut_off_anywhere_is_refused(version):
    payload = full_frame(version)
    decode_frame(payload, Version(*version))
    for size in range(len(payload)):
        with pytest.raises(MalformedPacketError):
            decode_frame(payload[:size], Version(*version))


@pytest.mark.parametrize("version", VERSIONS)
def test_a_frame_with_a_byte_too_many_is_refused(version):
    with pytest.raises(MalformedPacketError, match="suffix"):
        decode_frame(full_frame(version) + b"\0", Version(*version))


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("value", [-1, -(2**31), 2**31 - 1, 70_000, 5_461, 1_001])
def test_a_wrong_count_anywhere_costs_neither_time_nor_memory(version, value):
    payload = full_frame(version).ljust(65_000, b"\0")
    tracemalloc.start()
    try:
        for offset in range(4, 120, 2):
            broken = payload[:offset] + struct.pack("<i", value) + payload[offset + 4 :]
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            with pytest.raises(MalformedPacketError) as caught:
                decode_frame(broken, Version(*version))
            assert tracemalloc.get_traced_memory()[1] - before < 1_000_000
            assert 0 <= caught.value.offset <= caught.value.size == 65_000
    finally:
        tracemalloc.stop()


def worst_frames():
    """Payloads of full size whose counts promise as many small things as possible."""
    fill = 65_000
    for version in ((2, 9), (3, 0), (4, 1)):
        sized = version >= (4, 1)

        def counted(n, content, sized=sized):
            return struct.pack("<i", n) + (struct.pack("<i", len(content)) if sized else b"") + content

        most = fill // 5
        for n in (999, 1_000, 1_001, most):
            yield version, b"\1\0\0\0" + counted(n, (b"\0" + b"\0\0\0\0") * n)
            sets = (b"ab\0" + b"\0\0\0\0") * n
            yield version, b"\1\0\0\0" + counted(n, sets)
        none = counted(0, b"")
        skeletons = struct.pack("<ii", 1, 0) * 8_000
        yield version, b"\1\0\0\0" + none * 3 + counted(8_000, skeletons)
        tail = b"" if version < (4, 1) else none
        channels = struct.pack("<ii", 1, 16_000) + struct.pack("<i", 0) * 16_000
        yield version, b"\1\0\0\0" + none * 4 + tail + none + counted(1, channels)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "payload"), list(worst_frames()))
def test_the_worst_packet_is_refused_within_a_megabyte(version, payload):
    tracemalloc.start()
    try:
        with pytest.raises(MalformedPacketError):
            decode_frame(payload, Version(*version))
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
    best = min(timed(payload, version) for _ in range(3))
    assert best < 0.010


def timed(payload, version):
    start = time.thread_time()
    with pytest.raises(MalformedPacketError):
        decode_frame(payload, Version(*version))
    return time.thread_time() - start


@pytest.mark.slow
@settings(max_examples=300)
@given(data=st.data(), version=st.sampled_from(VERSIONS))
def test_a_mutated_packet_is_read_or_refused_and_nothing_else(data, version):
    payload = bytearray(full_frame(version))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(payload) - 4))
        payload[at : at + 4] = data.draw(st.binary(min_size=0, max_size=8))
        if len(payload) < 8:
            break
    with contextlib.suppress(MalformedPacketError):
        decode_frame(bytes(payload), Version(*version))


@pytest.mark.slow
@settings(max_examples=200)
@given(payload=st.binary(max_size=600), version=st.sampled_from(VERSIONS))
def test_random_bytes_are_refused(payload, version):
    for decode in (decode_frame, decode_models):
        with contextlib.suppress(MalformedPacketError):
            decode(payload, Version(*version))


def test_a_frame_read_as_another_version_is_refused():
    """Versions with different layouts never pass for each other: the suffix has to end with the payload."""
    layouts = [(2, 5), (2, 6), (2, 7), (2, 9), (3, 0), (4, 1)]
    for sent in layouts:
        payload = full_frame(sent)
        for read in layouts:
            if read != sent:
                with pytest.raises(MalformedPacketError):
                    decode_frame(payload, Version(*read))


def test_decoded_arrays_are_read_only_views_of_the_packet():
    payload = full_frame((4, 1))
    frame = decode_frame(payload, Version(4, 1))
    for array in (frame.markers, frame.rigid_bodies, frame.unlabelled, frame.marker_sets[0].positions):
        assert not array.flags.writeable
        assert not array.flags.owndata
    old = decode_frame(full_frame((2, 6)), Version(2, 6))
    assert not old.markers.flags.writeable
    assert not old.rigid_bodies.flags.writeable


def test_a_newer_version_may_have_longer_elements_and_unknown_sections():
    """Invented 4.9: labelled markers with 4 more bytes, and one section more before the suffix."""
    version, markers = (4, 3), [(65537, (1, 2, 3), 0.01, 10, 0.5), (65538, (4, 5, 6), 0.02, 11, 0.25)]
    rest = wire.frame_payload(version, Wire(markers=[]))
    section = b"".join(wire.marker_bytes(version, m) + b"new!" for m in markers)
    head, tail = rest[: 4 + 8 * 5], rest[4 + 8 * 6 :]
    suffix = wire.suffix_bytes(version, Wire())
    unknown = struct.pack("<ii", 3, 5) + b"?????"
    payload = head + struct.pack("<ii", 2, len(section)) + section + tail[: -len(suffix)] + unknown + suffix
    with pytest.raises(MalformedPacketError):
        decode_frame(payload, Version(4, 3))
    frame = decode_frame(payload, Version(4, 9))
    assert frame.markers["id"].tolist() == [65537, 65538]
    assert frame.markers["position"].tolist() == [[1, 2, 3], [4, 5, 6]]
    assert frame.markers["residual"].tolist() == [0.5, 0.25]


def every_description(version):
    kinds = [
        (5, wire.camera_description("Cam 1")),
        (0, wire.set_description("base", ["n1", "n2", "n3"])),
        (1, wire.body_description(version, "base", 12, ["n1", "n2", "n3"])),
        (2, wire.skeleton_description(version, "Fred", 3)),
    ]
    if version >= (3, 0):
        kinds += [(3, wire.plate_description()), (4, wire.device_description())]
    if version >= (4, 1):
        kinds.append((6, wire.asset_description(version, "tail", 7, [(1, "t1"), (7 << 16 | 2, "t2")])))
    kinds.append((0, wire.set_description("all", ["base_n1", "base_n2", "base_n3"])))
    return wire.models_payload(version, kinds)


@pytest.mark.parametrize("version", VERSIONS)
def test_labels_come_from_the_definitions_of_every_version(version):
    models = decode_models(every_description(version), Version(*version))
    labels = models.labels()
    assert {key: labels[key] for key in labels if key.startswith("base.")} == {
        "base.n1": 12 << 16 | 1,
        "base.n2": 12 << 16 | 2,
        "base.n3": 12 << 16 | 3,
    }
    if version >= (4, 1):
        assert (labels["tail.t1"], labels["tail.t2"]) == (7 << 16 | 1, 7 << 16 | 2)
    assert models.cameras == ("Cam 1",)
    assert [each.name for each in models.descriptions][-1] == "all"


@pytest.mark.parametrize("version", VERSIONS)
def test_a_label_that_two_markers_have_names_none(version):
    """Which of them a rig file means cannot be told; the last one must not win."""
    names, sets = ["n1", "n2", "n2"], [(0, wire.set_description("m1", ["n1", "n2", "n2"]))]
    first, other = ((1, wire.body_description(version, name, 1, names)) for name in ("m1", "m2"))
    again = (1, wire.body_description(version, "m1", 3, ["n1", "n2", "n3"]))
    sets += [(0, wire.set_description("m2", names))]
    once = decode_models(
        wire.models_payload(version, [*sets, first, first, other]), Version(*version)
    ).labels()
    twice = decode_models(
        wire.models_payload(version, [*sets, first, again, other]), Version(*version)
    ).labels()
    assert once["m1.n1"] == twice["m2.n1"] == 1 << 16 | 1
    assert not {"m1.n2", "m2.n2"} & {*once}
    assert "m1.n1" not in twice


@pytest.mark.parametrize("version", VERSIONS)
def test_definitions_cut_off_anywhere_are_refused(version):
    payload = every_description(version)
    for size in range(0, len(payload), 3):
        with pytest.raises(MalformedPacketError):
            decode_models(payload[:size], Version(*version))


def test_an_unknown_description_is_skipped_if_its_size_is_told():
    version = (4, 1)
    known = (1, wire.body_description(version, "m1", 2, ["n1"]))
    models = decode_models(wire.models_payload(version, [(9, b"?" * 17), known]), Version(*version))
    assert models.labels() == {"m1.n1": 2 << 16 | 1}
    assert models.skipped == (9,)
    with pytest.raises(MalformedPacketError, match="unknown description type 9"):
        decode_models(wire.models_payload((4, 0), [(9, b"?" * 17), known]), Version(4, 0))


def three_rings(version):
    return [(1, wire.body_description(version, f"m{k}", k, [f"n{i}" for i in (1, 2, 3)])) for k in (1, 2, 3)]


NINE = {f"m{k}.n{i}": k << 16 | i for k in (1, 2, 3) for i in (1, 2, 3)}


@pytest.mark.parametrize(("described", "read"), [((4, 2), (4, 1)), ((4, 3), (4, 1)), ((4, 1), (4, 2))])
def test_definitions_in_the_layout_of_another_version_lose_no_marker(described, read):
    """A server that is asked for an older bit stream may describe in its own."""
    kinds = [
        *three_rings(described),
        (2, wire.skeleton_description(described, "Fred", 3)),
        (6, wire.asset_description(described, "tail", 7, [(1, "t1")])),
    ]
    models = decode_models(wire.models_payload((4, 1), kinds), Version(*read))
    assert models.labels() == {**NINE, "tail.t1": 7 << 16 | 1}
    assert models.skipped == ()


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("more", [b"\0" * 40, b"\0", wire.name("m1")])
def test_nothing_may_follow_the_last_definition(version, more):
    with pytest.raises(MalformedPacketError, match="behind the last description"):
        decode_models(every_description(version) + more, Version(*version))


@pytest.mark.parametrize("version", [(4, 1), (4, 3), (4, 4), (4, 5), (5, 0)])
@pytest.mark.parametrize("kind", range(7))
def test_a_description_that_is_longer_than_known_is_read_as_far_as_it_is_known(version, kind):
    written = min(version, (4, 4))
    made = {
        0: wire.set_description("base", ["n1"]),
        1: wire.body_description(written, "base", 12, ["n1"]),
        2: wire.skeleton_description(written, "Fred", 3),
        3: wire.plate_description(),
        4: wire.device_description(),
        5: wire.camera_description("Cam 1"),
        6: wire.asset_description(written, "tail", 7, [(1, "t1")]),
    }
    kinds = [(kind, made[kind] + b"\1\2\3\4\5\6\7\x08"), *three_rings(written)]
    models = decode_models(wire.models_payload(written, kinds), Version(*version))
    named = {1: {"base.n1": 12 << 16 | 1}, 6: {"tail.t1": 7 << 16 | 1}}.get(kind, {})
    assert models.labels() == {**named, **NINE}


def test_a_description_that_ends_early_without_having_named_a_marker_is_refused():
    """Numbers that are read at the wrong place may say: no markers."""
    body = wire.body_description((4, 1), "base", 12, [])
    for version in ((4, 1), (4, 2), (4, 4)):
        with pytest.raises(MalformedPacketError, match="description of type 1 ends"):
            decode_models(wire.models_payload((4, 1), [(1, body + b"\0" * 24)]), Version(*version))


@pytest.mark.slow
def test_the_largest_definitions_stay_within_a_megabyte():
    names = [f"{k:02x}" for k in range(256)] * 80
    for version in ((2, 9), (4, 1)):
        big = wire.models_payload(version, [(0, wire.set_description("s", names[:20_000]))])
        tracemalloc.start()
        try:
            with pytest.raises(MalformedPacketError):
                decode_models(big, Version(*version))
            fits = wire.models_payload(version, [(0, wire.set_description("s", names[:5_990]))])
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            decode_models(fits, Version(*version))
            assert tracemalloc.get_traced_memory()[1] - before < 1_000_000
        finally:
            tracemalloc.stop()
