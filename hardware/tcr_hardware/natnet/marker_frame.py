"""A frame on our own clock."""

from __future__ import annotations

import time
from dataclasses import dataclass

from tcr_hardware.natnet.frame import MocapFrame
from tcr_hardware.natnet.models import ModelDefinitions


@dataclass(frozen=True, slots=True)
class MarkerFrame:
    """A received frame; times are those of ``time.monotonic`` [s].

    Attributes:
        session: How often the server has begun to count.
        sequence: Number of accepted frames before this one.
        arrival: When the packet was read from the socket.
        exposure: Middle of the exposure; None if the server does not tell or its clock is not yet known.
        software_latency: From the arrival of the camera data at the server to sending [s]; None if not told, as
            always before 3.0.
        data: The frame as sent.
        models: Names that belong to it; None while the server has announced a change and not yet told the names.
        doubt: Why nothing in it can be believed; empty if it can.
    """

    session: int
    sequence: int
    arrival: float
    exposure: float | None
    software_latency: float | None
    data: MocapFrame
    models: ModelDefinitions | None
    doubt: str = ""

    @property
    def number(self) -> int:
        """The server's count."""
        return self.data.number

    @property
    def taken_at(self) -> float:
        """Best estimate of the instant at which the markers were where they are reported [s]."""
        if self.exposure is not None:
            return self.exposure
        return self.arrival - (self.software_latency or 0.0)

    def age(self, now: float | None = None) -> float:
        """Return the time since ``taken_at`` [s]."""
        return (time.monotonic() if now is None else now) - self.taken_at
