"""Where the server is and how it streams."""

from __future__ import annotations

from dataclasses import dataclass

from tcr_hardware.natnet.protocol import COMMAND_PORT, Version


@dataclass(frozen=True, slots=True)
class NatNetSettings:
    """Settings of the client.

    Attributes:
        server: Host of Motive.
        local: Address of our network interface to the cameras.
        multicast: True if Motive is set to multicast, False for unicast.
        command_port: Port on which Motive takes requests.
        data_port: Port at which frames arrive; None: as the server says.
        group: Multicast group; None: as the server says.
        bitstream: Version to ask for (``4.1``), unicast and Motive 3 or newer only; None: the server's own, or 4.1
            from a server newer than this client.
        allow_newer: Read streams of unknown newer versions as far as their sections can be skipped.
        keep_alive_s: Period of keep-alives, unicast only [s].
        echo_s: Period of clock requests [s].
        silence_s: Connect anew after so long without a frame [s].
    """

    server: str = "127.0.0.1"
    local: str = "127.0.0.1"
    multicast: bool = True
    command_port: int = COMMAND_PORT
    data_port: int | None = None
    group: str | None = None
    bitstream: str | None = None
    allow_newer: bool = False
    keep_alive_s: float = 1.0
    echo_s: float = 0.25
    silence_s: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: A port, period or version is out of range; the message names it.
        """
        for name, port in (("command_port", self.command_port), ("data_port", self.data_port)):
            if port is not None and not 1 <= port <= 65535:
                raise ValueError(f"{name} is {port}, allowed 1 to 65535")
        for name in ("keep_alive_s", "echo_s", "silence_s"):
            if not 0.0 < getattr(self, name) < float("inf"):
                raise ValueError(f"{name} is {getattr(self, name)}, must be positive")
        if self.bitstream is not None:
            Version.parse(self.bitstream)

    @property
    def address(self) -> str:
        """Server and port of requests, for messages."""
        return f"{self.server}:{self.command_port}"
