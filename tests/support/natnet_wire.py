"""A NatNet encoder for tests: plain values in, bytes out, every section filled; shares nothing with the product."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

VERSIONS = [(2, 5), (2, 6), (2, 7), (2, 9), (2, 10), (3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 3), (4, 4)]


@dataclass
class Wire:
    """Content of one frame as plain numbers."""

    number: int = 7
    sets: list = field(default_factory=list)  # (name, [xyz])
    unlabelled: list = field(default_factory=list)  # xyz
    bodies: list = field(default_factory=list)  # (id, xyz, xyzw, error, params, [(xyz, id, size)])
    skeletons: list = field(default_factory=list)  # (id, [body])
    assets: list = field(default_factory=list)  # (id, [body], [marker])
    markers: list = field(default_factory=list)  # (id, xyz, size, params, residual)
    plates: list = field(default_factory=list)  # (id, [[samples]])
    devices: list = field(default_factory=list)
    latency: float = 0.0
    timecode: tuple = (0, 0)
    timestamp: float = 0.0
    ticks: tuple = (0, 0, 0)
    precision: tuple = (0, 0)
    params: int = 0


def name(text):
    return text.encode() + b"\0"


def count_of(version, elements):
    body = b"".join(elements)
    if version >= (4, 1):
        return struct.pack("<i", len(elements)) + struct.pack("<i", len(body)) + body
    return struct.pack("<i", len(elements)) + body


def body_bytes(version, body):
    number, xyz, xyzw, error, params, markers = body
    out = struct.pack("<i", number) + struct.pack("<3f", *xyz) + struct.pack("<4f", *xyzw)
    if version < (3, 0):
        out += struct.pack("<i", len(markers))
        out += b"".join(struct.pack("<3f", *marker[0]) for marker in markers)
        out += b"".join(struct.pack("<i", marker[1]) for marker in markers)
        out += b"".join(struct.pack("<f", marker[2]) for marker in markers)
    out += struct.pack("<f", error)
    if version >= (2, 6):
        out += struct.pack("<h", params)
    return out


def marker_bytes(version, marker):
    number, xyz, size, params, residual = marker
    out = struct.pack("<i", number) + struct.pack("<3f", *xyz) + struct.pack("<f", size)
    if version >= (2, 6):
        out += struct.pack("<h", params)
    if version >= (3, 0):
        out += struct.pack("<f", residual)
    return out


def analog_bytes(analog):
    number, channels = analog
    out = struct.pack("<ii", number, len(channels))
    for samples in channels:
        out += struct.pack("<i", len(samples)) + struct.pack(f"<{len(samples)}f", *samples)
    return out


def listed(elements):
    return struct.pack("<i", len(elements)) + b"".join(elements)


def suffix_bytes(version, wire):
    out = struct.pack("<f", wire.latency) if version < (3, 0) else b""
    out += struct.pack("<I", wire.timecode[0]) + struct.pack("<I", wire.timecode[1])
    if version == (2, 6):
        out += struct.pack("<f", wire.timestamp)
    if version >= (2, 7):
        out += struct.pack("<d", wire.timestamp)
    if version >= (3, 0):
        out += b"".join(struct.pack("<Q", ticks) for ticks in wire.ticks)
    if version >= (4, 1):
        out += struct.pack("<I", wire.precision[0]) + struct.pack("<I", wire.precision[1])
    if version >= (2, 6):
        out += struct.pack("<h", wire.params)
    return out + b"\0\0\0\0"


def frame_payload(version, wire):
    """Payload of FRAMEOFDATA."""
    out = struct.pack("<i", wire.number)
    sets = [name(n) + listed([struct.pack("<3f", *xyz) for xyz in points]) for n, points in wire.sets]
    out += count_of(version, sets)
    out += count_of(version, [struct.pack("<3f", *xyz) for xyz in wire.unlabelled])
    out += count_of(version, [body_bytes(version, body) for body in wire.bodies])
    skeletons = [
        struct.pack("<i", number) + listed([body_bytes(version, body) for body in bodies])
        for number, bodies in wire.skeletons
    ]
    out += count_of(version, skeletons)
    if version >= (4, 1):
        assets = [
            struct.pack("<i", number)
            + listed([body_bytes(version, body) for body in bodies])
            + listed([marker_bytes(version, marker) for marker in markers])
            for number, bodies, markers in wire.assets
        ]
        out += count_of(version, assets)
    out += count_of(version, [marker_bytes(version, marker) for marker in wire.markers])
    if version >= (2, 9):
        out += count_of(version, [analog_bytes(plate) for plate in wire.plates])
    if version >= (2, 11):
        out += count_of(version, [analog_bytes(device) for device in wire.devices])
    return out + suffix_bytes(version, wire)


def packet(message, payload=b""):
    return struct.pack("<HH", message, len(payload)) + payload


def server_info(version, *, clock_hz=10_000_000, data_port=1511, multicast=0, group=(239, 255, 42, 99)):
    """Payload of SERVERINFO, with what real servers leave behind the name."""
    out = b"Motive\0garbage".ljust(256, b"\xfe") + bytes((3, 1, 0, 1)) + bytes((*version, 0, 0))
    if version >= (3, 0):
        out += struct.pack("<Q", clock_hz) + struct.pack("<H", data_port) + bytes((multicast, *group))
    return out


def body_description(version, label, number, markers, parent=-1):
    out = name(label) + struct.pack("<ii", number, parent) + struct.pack("<3f", 0.1, 0.2, 0.3)
    if version >= (4, 2):
        out += struct.pack("<4f", 0, 0, 0, 1)
    if version >= (3, 0):
        n = len(markers)
        out += (
            struct.pack("<i", n) + struct.pack(f"<{3 * n}f", *range(3 * n)) + struct.pack(f"<{n}i", *range(n))
        )
    if version >= (4, 0):
        out += b"".join(name(marker) for marker in markers)
    return out


def set_description(label, markers):
    return name(label) + listed([name(marker) for marker in markers])


def plate_description():
    out = struct.pack("<i", 3) + name("SN-1") + struct.pack("<2f3f", 0.4, 0.6, 1, 2, 3)
    out += struct.pack("<144f", *range(144)) + struct.pack("<12f", *range(12)) + struct.pack("<ii", 1, 0)
    return out + listed([name("Fx"), name("Fy")])


def device_description():
    return struct.pack("<i", 4) + name("NI") + name("SN-2") + struct.pack("<ii", 1, 0) + listed([name("a0")])


def camera_description(label):
    return name(label) + struct.pack("<3f4f", 1, 2, 3, 0, 0, 0, 1)


def skeleton_description(version, label, number):
    bones = [body_description(version, f"bone{k}", k, ["a", "b"], parent=k - 1) for k in (1, 2)]
    return name(label) + struct.pack("<i", number) + listed(bones)


def asset_description(version, label, number, markers):
    bones = [body_description(version, "bone", 1, ["a"])]
    rows = [
        name(marker) + struct.pack("<i", member) + struct.pack("<3ff", 0, 0, 0, 0.01) + struct.pack("<h", 0)
        for member, marker in markers
    ]
    return name(label) + struct.pack("<ii", 1, number) + listed(bones) + listed(rows)


def models_payload(version, descriptions):
    """Payload of MODELDEF from (type, bytes)."""
    out = []
    for kind, content in descriptions:
        size = struct.pack("<i", len(content)) if version >= (4, 1) else b""
        out.append(struct.pack("<i", kind) + size + content)
    return listed(out)


def simple_models(version, **bodies):
    """Marker set and rigid body for every keyword: name = list of markers."""
    out = []
    for number, (label, markers) in enumerate(bodies.items(), start=1):
        out += [(0, set_description(label, markers)), (1, body_description(version, label, number, markers))]
    return models_payload(version, out)


def random_frame(random):
    """A frame of arbitrary content; ``random`` is a seeded ``random.Random``."""

    def several(make, most=3):
        return [make() for _ in range(random.randint(0, most))]

    def real():
        return struct.unpack(
            "<f", struct.pack("<f", random.choice([0.0, -1.5e-3, 3.4e38, random.gauss(0, 1)]))
        )[0]

    def xyz():
        return (real(), real(), real())

    def i32():
        return random.randint(-(2**31), 2**31 - 1)

    def i16():
        return random.randint(-(2**15), 2**15 - 1)

    def body():
        markers = several(lambda: (xyz(), i32(), real()))
        return (i32(), xyz(), (real(), *xyz()), real(), i16(), markers)

    def marker():
        return (i32(), xyz(), real(), i16(), real())

    def analog():
        return (i32(), several(lambda: several(real, 4)))

    return Wire(
        number=i32(),
        sets=several(lambda: (random.choice(["", "a", "Räder", "x" * 255]), several(xyz))),
        unlabelled=several(xyz),
        bodies=several(body),
        skeletons=several(lambda: (i32(), several(body))),
        assets=several(lambda: (i32(), several(body), several(marker))),
        markers=several(marker),
        plates=several(analog),
        devices=several(analog),
        latency=real(),
        timecode=(random.getrandbits(32), random.getrandbits(32)),
        timestamp=real(),
        ticks=(random.getrandbits(64), random.getrandbits(64), random.getrandbits(64)),
        precision=(random.getrandbits(32), random.getrandbits(32)),
        params=i16(),
    )
