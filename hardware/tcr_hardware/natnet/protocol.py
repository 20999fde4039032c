"""The envelope of NatNet [NN24]: message numbers, versions, requests, and who the server says it is.

Everything is little-endian. A datagram is ``u16 message, u16 size of the payload``, then the payload.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from tcr_hardware.natnet.errors import MalformedPacketError

COMMAND_PORT = 1510
DATA_PORT = 1511
MULTICAST_GROUP = "239.255.42.99"
LARGEST_DATAGRAM = 65507

HEADER = struct.Struct("<HH")
#: Name of the program, its version, the version of NatNet.
SENDER = struct.Struct("<256s4s4s")
#: From 3.0: ticks per second of the server's clock, data port, streams multicast, multicast group.
SENDER_CLOCK = struct.Struct("<QHB4s")
#: From 4.0, after the sender: subscribed data only, version of the bit stream wanted.
CONNECT_OPTIONS = struct.Struct("<B4B")
ECHO_REQUEST = struct.Struct("<Q")
ECHO_RESPONSE = struct.Struct("<QQ")


class Message(IntEnum):
    """Message numbers, in both directions."""

    CONNECT = 0
    SERVERINFO = 1
    REQUEST = 2
    RESPONSE = 3
    REQUEST_MODELDEF = 4
    MODELDEF = 5
    REQUEST_FRAMEOFDATA = 6
    FRAMEOFDATA = 7
    MESSAGESTRING = 8
    DISCONNECT = 9
    KEEPALIVE = 10
    DISCONNECTBYTIMEOUT = 11
    ECHOREQUEST = 12
    ECHORESPONSE = 13
    DISCOVERY = 14
    UNRECOGNIZED_REQUEST = 100


class Version(NamedTuple):
    """A version of NatNet; versions compare in order."""

    major: int
    minor: int

    @classmethod
    def parse(cls, text: str) -> Version:
        """Read ``"4.1"``, with anything after a second dot ignored.

        Raises:
            ValueError: ``text`` is not a version.
        """
        match = re.fullmatch(r"(\d{1,3})\.(\d{1,3})(\.\d+)*", text.strip())
        if match is None:
            raise ValueError(f"{text!r} is not a NatNet version like 4.1")
        return cls(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        """Return ``major.minor``."""
        return f"{self.major}.{self.minor}"


OLDEST = Version(2, 5)
NEWEST = Version(4, 4)
#: Our own version in CONNECT: the newest whose requests are known.
ANNOUNCED = Version(4, 3)
#: What is asked of a server that is newer than ``NEWEST``: the newest layout proven against foreign decoders.
PINNED = Version(4, 1)


@dataclass(frozen=True, slots=True)
class ServerInfo:
    """Who the server says it is.

    Attributes:
        application: Name of the program ("Motive").
        application_version: Its version, four numbers.
        version: Newest version of NatNet it speaks.
        clock_hz: Ticks per second of its clock; 0 before 3.0.
        data_port: Port it sends frames to; ``DATA_PORT`` before 3.0.
        multicast: Whether it streams to a multicast group; None before 3.0.
        group: That group.
    """

    application: str
    application_version: tuple[int, ...]
    version: Version
    clock_hz: int
    data_port: int
    multicast: bool | None
    group: str

    @classmethod
    def decode(cls, payload: bytes) -> ServerInfo:
        """Read the payload of SERVERINFO.

        Raises:
            MalformedPacketError: Too short for the version that it names.
        """
        if len(payload) < SENDER.size:
            raise MalformedPacketError("server info too short", len(payload), len(payload))
        name, application_version, natnet = SENDER.unpack_from(payload)
        # The rest of the buffer behind the name is whatever lay in the server's memory.
        application = name.partition(b"\0")[0].decode("utf-8", "replace")
        version = Version(natnet[0], natnet[1])
        clock_hz = 0
        data_port = DATA_PORT
        multicast = None
        group = MULTICAST_GROUP
        if version >= (3, 0):
            if len(payload) < SENDER.size + SENDER_CLOCK.size:
                raise MalformedPacketError("server info without clock", len(payload), len(payload))
            clock_hz, data_port, flag, raw_group = SENDER_CLOCK.unpack_from(payload, SENDER.size)
            multicast, group = bool(flag), ".".join(map(str, raw_group))
        return cls(application, tuple(application_version), version, clock_hz, data_port, multicast, group)


def envelope(message: Message, payload: bytes = b"") -> bytes:
    """Put a message and its payload into a datagram."""
    return HEADER.pack(message, len(payload)) + payload


def message_of(datagram: bytes) -> int | None:
    """Return the message number of a datagram; None if it is too short to have one."""
    return int.from_bytes(datagram[:2], "little") if len(datagram) >= HEADER.size else None


def split(datagram: bytes) -> tuple[int, bytes]:
    """Take a datagram apart: message number (may be unknown) and payload.

    Raises:
        MalformedPacketError: The datagram is shorter than it says.
    """
    if len(datagram) < HEADER.size:
        raise MalformedPacketError("header cut off", len(datagram), len(datagram))
    message, size = HEADER.unpack_from(datagram)
    if HEADER.size + size > len(datagram):
        raise MalformedPacketError(f"header promises {size} bytes", len(datagram), len(datagram))
    return message, datagram[HEADER.size : HEADER.size + size]


def connect(bitstream: Version | None = None) -> bytes:
    """Ask the server to answer and, in unicast, to stream to us; 0.0 leaves the version to the server."""
    sender = SENDER.pack(b"tcrctl", bytes(4), bytes((*ANNOUNCED, 0, 0)))
    wanted = bitstream or Version(0, 0)
    return envelope(Message.CONNECT, sender + CONNECT_OPTIONS.pack(0, *wanted, 0, 0))


def request(text: str) -> bytes:
    """Ask the server something, for instance ``FrameRate``."""
    return envelope(Message.REQUEST, text.encode() + b"\0")


def echo_request(client_ns: int) -> bytes:
    """Ask the server for its clock; ``client_ns`` comes back with the answer."""
    return envelope(Message.ECHOREQUEST, ECHO_REQUEST.pack(client_ns))


def decode_echo(payload: bytes) -> tuple[int, int]:
    """Read an echo: our own time [ns] that we had sent, and the server's clock [ticks].

    Raises:
        MalformedPacketError: Too short.
    """
    if len(payload) < ECHO_RESPONSE.size:
        raise MalformedPacketError("echo too short", len(payload), len(payload))
    client_ns, ticks = ECHO_RESPONSE.unpack_from(payload)
    return client_ns, ticks
