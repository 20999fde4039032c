"""How the emulated Motive server answers requests: every form of them that has been seen in the wild."""

from __future__ import annotations

import struct
import time
from typing import Protocol

from tcr_hardware.emulators import motive_encoder as encoder
from tcr_hardware.emulators.motive_encoder import Version
from tcr_hardware.emulators.motive_link import MotiveLink
from tcr_hardware.emulators.motive_markers import TrackedMarkers
from tcr_hardware.emulators.motive_settings import MotiveSettings

NAME = "Motive (emulated)"
CLOCK_HZ = 10_000_000
(CONNECT, SERVERINFO, REQUEST, RESPONSE, REQUEST_MODELDEF, MODELDEF, REQUEST_FRAMEOFDATA) = range(7)
DISCONNECT, KEEPALIVE = 9, 10
ECHOREQUEST, ECHORESPONSE, DISCOVERY, UNRECOGNIZED_REQUEST = 12, 13, 14, 100
#: Behind the sender in CONNECT: subscribed data only, version wanted.
OPTIONS_AT = 264


class Server(Protocol):
    """What an answer is made from.

    Attributes:
        settings: Settings of the server.
        tracked: Names and bodies.
        version: Newest version served now.
        link: Who is connected.
    """

    settings: MotiveSettings
    tracked: TrackedMarkers
    version: Version
    link: MotiveLink

    def ticks(self, at: float) -> int:
        """Return the server's clock at a time of ``time.monotonic`` [s]."""
        ...

    def latest(self, version: Version) -> bytes:
        """Return the markers now, as one FRAMEOFDATA packet."""
        ...


def answer(server: Server, datagram: bytes, address: tuple[str, int]) -> list[bytes]:
    """Return the answers to one request, possibly none."""
    if len(datagram) < 4:
        return []
    message = int.from_bytes(datagram[:2], "little")
    payload = datagram[4:]  # some clients send a byte more than they say
    client = server.link.clients.get(address)
    if client is not None:
        client.heard = time.monotonic()
    version = server.version if client is None else client.version
    if message in (CONNECT, DISCOVERY):
        return [_connect(server, payload, address, discovery=message == DISCOVERY)]
    if message == REQUEST:
        return [_request(server, payload, address)]
    if message == REQUEST_MODELDEF:
        return [encoder.packet(MODELDEF, encoder.models(version, server.tracked))]
    if message == REQUEST_FRAMEOFDATA:
        return [server.latest(version)]
    if message == ECHOREQUEST and len(payload) >= 8 and server.version >= (3, 0):
        return [encoder.packet(ECHORESPONSE, payload[:8] + struct.pack("<Q", server.ticks(time.monotonic())))]
    if message == DISCONNECT:
        server.link.clients.pop(address, None)
        return []
    if message == KEEPALIVE:
        return []
    return [_unrecognized(server)]


def _connect(server: Server, payload: bytes, address: tuple[str, int], *, discovery: bool) -> bytes:
    settings, wanted = server.settings, server.version
    if len(payload) >= OPTIONS_AT + 5 and server.version >= (4, 0):
        asked = (payload[OPTIONS_AT + 1], payload[OPTIONS_AT + 2])
        if (3, 0) <= asked <= server.version:
            wanted = asked
    if not discovery:
        server.link.register(address, wanted)
    info = encoder.server_info(
        NAME, server.version, CLOCK_HZ, settings.data_port, settings.multicast, settings.group
    )
    return encoder.packet(SERVERINFO, info)


def _request(server: Server, payload: bytes, address: tuple[str, int]) -> bytes:
    name, _, argument = payload.partition(b"\0")[0].decode("utf-8", "replace").partition(",")
    if name == "FrameRate":
        return encoder.packet(RESPONSE, struct.pack("<f", server.settings.rate_hz))
    if name == "UnitsToMillimeters":
        return encoder.packet(RESPONSE, struct.pack("<f", 1000.0))
    if name in ("CurrentMode", "SubscribeToData", "SubscribedDataOnly"):
        return encoder.packet(RESPONSE, struct.pack("<i", 0))
    if name == "Bitstream" and server.version >= (4, 0) and not server.settings.multicast:
        return _bitstream(server, argument, address)
    return _unrecognized(server)


def _bitstream(server: Server, argument: str, address: tuple[str, int]) -> bytes:
    client = server.link.clients.get(address)
    if not argument:
        major, minor = server.version if client is None else client.version
        return encoder.packet(RESPONSE, encoder.text(f"Bitstream,{major}.{minor}"))
    try:
        asked: Version = tuple(int(part) for part in argument.split(".")[:2])  # type: ignore[assignment]
    except ValueError:
        return _unrecognized(server)
    if client is not None and (3, 0) <= asked <= server.version and client.version != asked:
        client.version, client.flagged = asked, 1
    return encoder.packet(RESPONSE, struct.pack("<i", 0))


def _unrecognized(server: Server) -> bytes:
    return encoder.packet(UNRECOGNIZED_REQUEST, encoder.sender(NAME, server.version))
