"""The sockets of a client: one for requests, one or more at which frames arrive."""

from __future__ import annotations

import socket
import sys
from dataclasses import dataclass, field

from tcr_hardware.errors import SocketError
from tcr_hardware.natnet.protocol import DATA_PORT, MULTICAST_GROUP, ServerInfo, connect
from tcr_hardware.natnet.settings import NatNetSettings

#: Holds large frames while Python is busy; the system may allow less.
RECEIVE_BUFFER = 1 << 20


def resolve(host: str) -> str:
    """Look up the address of a host.

    Raises:
        SocketError: There is no such host.
    """
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise SocketError(host, str(error), hint="Check the name or address of the server.") from None


def refuses(address: tuple[str, int]) -> bool:
    """Tell whether the computer at ``address`` says that nobody listens at that port; False if it says nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.settimeout(0.1)
        try:
            probe.connect(address)  # only a connected socket is told
            probe.send(connect())
            probe.recv(1)
        except ConnectionRefusedError:
            return True
        except OSError:
            pass
    return False


def _udp() -> socket.socket:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setblocking(False)
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return udp


def _bind(udp: socket.socket, host: str, port: int) -> socket.socket:
    try:
        udp.bind((host, port))
    except OSError as error:
        udp.close()
        raise SocketError(f"{host or '*'}:{port}", error.strerror or str(error)) from None
    return udp


def _multicast(local: str, group: str, port: int) -> socket.socket:
    """Join a group at one interface."""
    udp = _udp()
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if sys.platform == "darwin":
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    # Bound to the group the socket hears nothing else; Windows does not allow that.
    _bind(udp, "" if sys.platform == "win32" else group, port)
    try:
        udp.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(local)
        )
    except OSError as error:
        udp.close()
        raise SocketError(
            f"{group} at {local}",
            error.strerror or str(error),
            hint="`local` must be the address of this computer on the camera network.",
        ) from None
    return udp


@dataclass(slots=True)
class Sockets:
    """Open sockets of a client.

    Attributes:
        command: Sends requests; receives answers, in unicast frames too.
        data: Receive frames, by (group or local address, port).
        note: Why a data socket is missing, or empty.
    """

    settings: NatNetSettings
    command: socket.socket
    data: dict[tuple[str, int], socket.socket] = field(default_factory=dict)
    note: str = ""
    _tried: set[tuple[str, int]] = field(default_factory=set)

    @classmethod
    def open(cls, settings: NatNetSettings) -> Sockets:
        """Open the command socket and the data socket at the configured or usual place.

        Raises:
            SocketError: ``local`` is not an address of this computer, or the group cannot be joined.
        """
        sockets = cls(settings, _bind(_udp(), settings.local, 0))
        try:
            sockets.listen(settings.group or MULTICAST_GROUP, settings.data_port or DATA_PORT)
        except SocketError:
            sockets.close()
            raise
        return sockets

    def listen(self, group: str, port: int) -> bool:
        """Listen for frames at a port; return whether that is a new place.

        In unicast some servers send to this port and others to the command socket, so a port in use by another
        program (Motive on the same computer) is no error.

        Raises:
            SocketError: The group cannot be joined.
        """
        place = (group if self.settings.multicast else self.settings.local, port)
        if place in self._tried:
            return False
        self._tried.add(place)
        if self.settings.multicast:
            self.data[place] = _multicast(self.settings.local, group, port)
            return True
        try:
            self.data[place] = _bind(_udp(), *place)
        except SocketError as error:
            self.note = f"not listening at {error}"
            return False
        return True

    def follow(self, server: ServerInfo) -> bool:
        """Listen where the server says it sends, unless the settings say otherwise; return whether that is new.

        Raises:
            SocketError: The group cannot be joined.
        """
        return self.listen(self.settings.group or server.group, self.settings.data_port or server.data_port)

    def all(self) -> list[socket.socket]:
        """Return every open socket."""
        return [self.command, *self.data.values()]

    def close(self) -> None:
        """Close them."""
        for each in self.all():
            each.close()
