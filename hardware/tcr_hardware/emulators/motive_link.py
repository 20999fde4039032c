"""Sockets and listeners of the emulated Motive server."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from dataclasses import dataclass

from tcr_hardware.emulators.motive_settings import MotiveSettings

Address = tuple[str, int]
Version = tuple[int, int]
LARGEST_DATAGRAM = 65507


@dataclass(slots=True)
class Client:
    """A listener: the version it gets, when it was last heard, and in how many frames a new version is flagged."""

    version: Version
    heard: float
    flagged: int = 0


class MotiveLink:
    """One socket for requests and unicast frames, one for multicast.

    Attributes:
        clients: Unicast clients by the address that they connected from.
    """

    def __init__(self, settings: MotiveSettings) -> None:
        self.settings = settings
        self.clients: dict[Address, Client] = {}
        self._everybody = Client((0, 0), float("inf"))
        self._command = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._command.setblocking(False)
        self._group: socket.socket | None = None
        self._stranger: socket.socket | None = None
        try:
            self._command.bind((settings.host, settings.command_port))
            if settings.multicast:
                self._group = _multicast_sender(settings.host)
        except OSError:
            self.close()
            raise

    @property
    def address(self) -> Address:
        """Host and port of requests."""
        host, port = self._command.getsockname()
        return host, port

    def listeners(self, version: Version) -> list[tuple[Address, Client]]:
        """Return where frames go, and to whom."""
        if self._group is not None:
            self._everybody.version = version
            return [((self.settings.group, self.settings.data_port), self._everybody)]
        if self.settings.unicast_to == "sender":
            return list(self.clients.items())
        return [((host, self.settings.data_port), client) for (host, _), client in self.clients.items()]

    def register(self, address: Address, version: Version) -> None:
        """Stream to a unicast client from now on."""
        if not self.settings.multicast:
            self.clients[address] = Client(version, time.monotonic())

    def change_version(self, version: Version, flagged: int) -> None:
        """Give every listener another version, and flag it in so many frames."""
        for client in [self._everybody, *self.clients.values()]:
            client.version, client.flagged = version, flagged

    def expire(self, now: float) -> list[Address]:
        """Forget and return clients that have been silent for too long."""
        limit = now - self.settings.keep_alive_timeout_s
        silent = [address for address, client in self.clients.items() if client.heard < limit]
        for address in silent:
            del self.clients[address]
        return silent

    def receive(self, wait_s: float) -> list[tuple[bytes, Address]]:
        """Wait up to ``wait_s`` for requests; return those that came."""
        select.select([self._command], [], [], min(max(wait_s, 0.0), 0.1))
        found: list[tuple[bytes, Address]] = []
        while len(found) < 16:
            try:
                found.append(self._command.recvfrom(LARGEST_DATAGRAM))
            except BlockingIOError:
                break
            except ConnectionError:
                continue  # a client has gone without a word
        return found

    def send(self, datagram: bytes, destination: Address) -> None:
        """Send, and do not mind whether anybody listens."""
        through = self._command
        if self._group is not None and destination[0] == self.settings.group:
            through = self._group
        with contextlib.suppress(BlockingIOError, ConnectionError):
            through.sendto(datagram, destination)

    def send_as_stranger(self, datagram: bytes, destination: Address) -> None:
        """Send as another program on this computer would, from a port of its own."""
        if self._stranger is None:
            self._stranger = _multicast_sender(self.settings.host)
            self._stranger.bind((self.settings.host, 0))
        with contextlib.suppress(BlockingIOError, ConnectionError):
            self._stranger.sendto(datagram, destination)

    def close(self) -> None:
        """Close the sockets."""
        for each in (self._command, self._group, self._stranger):
            if each is not None:
                each.close()


def _multicast_sender(host: str) -> socket.socket:
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setblocking(False)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(host))
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0 if host.startswith("127.") else 1)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
    return sender
