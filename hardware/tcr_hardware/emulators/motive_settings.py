"""How the emulated Motive server streams."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MotiveSettings:
    """Settings of the emulated server.

    Attributes:
        host: Address to serve at.
        command_port: Port for requests; 0 takes a free one.
        data_port: Port that frames are sent to, in multicast and for ``unicast_to="data_port"``.
        multicast: Stream to ``group``, else to every client.
        group: Multicast group.
        unicast_to: Whether frames go to the socket that connected (``sender``) or to ``data_port`` of its computer.
        version: Newest NatNet version served.
        rate_hz: Frames per second.
        latency_s: From the middle of the exposure to sending [s].
        clock_offset_s: Server clock minus ``time.monotonic`` [s].
        clock_drift: Relative error of the server clock.
        keep_alive_timeout_s: Unicast clients that are silent for so long are dropped [s].
        seed: Of the random faults.
    """

    host: str = "127.0.0.1"
    command_port: int = 1510
    data_port: int = 1511
    multicast: bool = False
    group: str = "239.255.42.99"
    unicast_to: str = "sender"
    version: str = "4.1"
    rate_hz: float = 240.0
    latency_s: float = 0.003
    clock_offset_s: float = 1000.0
    clock_drift: float = 20e-6
    keep_alive_timeout_s: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: A setting is out of range; the message names it.
        """
        if self.unicast_to not in ("sender", "data_port"):
            raise ValueError(f"unicast_to is {self.unicast_to!r}, allowed sender, data_port")
        if re.fullmatch(r"\d+\.\d+", self.version) is None:
            raise ValueError(f"version is {self.version!r}, must be like 4.1")
        if not (self.rate_hz > 0.0 and self.latency_s >= 0.0):
            raise ValueError(
                f"rate_hz is {self.rate_hz} and latency_s {self.latency_s}, must not be negative"
            )
