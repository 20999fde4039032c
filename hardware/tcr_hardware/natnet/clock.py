"""The server's clock on our own, by echo: a request answered within a short round trip dates the server's ticks."""

from __future__ import annotations

from dataclasses import dataclass

#: Clocks of two computers drift apart by less than this [s/s]: crystals are within 50e-6 each, and a time
#: service may slew ours by 500e-6.
LARGEST_DRIFT = 600e-6
#: A contradiction beyond this is no error of measurement: the server's clock began anew [s].
SMALLEST_JUMP = 0.01


@dataclass(slots=True)
class Echo:
    """One answered request.

    Attributes:
        offset: Our clock minus the server's, if the answer was made half-way [s].
        uncertainty: The offset is within this of the truth: half the round trip [s].
        at: When the answer arrived, our clock [s].
    """

    offset: float
    uncertainty: float
    at: float

    def uncertainty_at(self, now: float) -> float:
        """Return the uncertainty after drifting until ``now`` [s]."""
        return self.uncertainty + LARGEST_DRIFT * (now - self.at)


class ServerClock:
    """Offset between the server's clock and ours, with a bound.

    Of all echoes so far the one with the smallest uncertainty *now* is used: a short round trip counts until drift
    has eaten its advantage. An answer that contradicts it beyond both bounds is believed instead; far beyond them
    it means that the server's clock began anew.

    Attributes:
        hz: Ticks per second of the server's clock; 0 while unknown.
        best: The echo in use, or None.
        round_trip: Of the last echo [s], or None.
        steps: How often the server's clock jumped.
    """

    def __init__(self) -> None:
        self.hz = 0
        self.best: Echo | None = None
        self.round_trip: float | None = None
        self.steps = 0

    def reset(self, hz: int) -> None:
        """Begin anew with a server whose clock has ``hz`` ticks per second (0: it has none)."""
        self.hz = hz
        self.best = None
        self.round_trip = None

    def add(self, sent: float, received: float, ticks: int) -> bool:
        """Take an echo: our times of request and answer [s], the server's time between them [ticks].

        Returns:
            Whether the server's clock jumped.
        """
        if self.hz <= 0 or received < sent:
            return False
        half = 0.5 * (received - sent)
        echo = Echo(sent + half - ticks / self.hz, half, received)
        self.round_trip = 2.0 * half
        if self.best is None:
            self.best = echo
            return False
        bound = self.best.uncertainty_at(received)
        contradiction = abs(echo.offset - self.best.offset) - (bound + half)
        if contradiction > 0.0 or half <= bound:
            self.best = echo
        jumped = contradiction > SMALLEST_JUMP
        self.steps += jumped
        return jumped

    def local(self, ticks: int) -> float | None:
        """Return server ticks on our clock [s]; None if the server did not say (0) or no echo has come back yet."""
        if ticks == 0 or self.best is None:
            return None
        return ticks / self.hz + self.best.offset

    def uncertainty(self, now: float) -> float | None:
        """Bound of the error of ``local`` [s]; None before the first echo."""
        return None if self.best is None else self.best.uncertainty_at(now)
