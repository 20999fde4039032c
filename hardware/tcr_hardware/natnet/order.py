"""Which frames are new: UDP may lose, repeat and reorder them, and a server may begin to count anew."""

from __future__ import annotations

from enum import Enum

#: A number this far behind the newest is no late packet: the server counts anew (restart, loop in playback).
REORDER_WINDOW = 64
#: A number this far ahead is no gap: a corrupt number, or a jump in playback.
LARGEST_GAP = 10_000
#: So many numbers in a row have to go on from an implausible one until it is believed.
AGREEING = 3
#: The same for numbers that may be repeated packets.
AGREEING_NEAR = 16
#: After so long without a new frame a lower number is a new session at once [s].
SILENCE = 1.0


class Arrival(Enum):
    """What a frame turned out to be; only ``NEXT`` and ``NEW_SESSION`` are used."""

    NEXT = "next"
    NEW_SESSION = "new session"
    DUPLICATE = "duplicate"
    LATE = "late"
    UNDECIDED = "undecided"


class FrameOrder:
    """Sorts frames by their numbers.

    Attributes:
        last: Newest number of the session; None before the first frame.
        lost: Numbers that were passed over and have not come since.
        late: Frames that came after a newer one.
        duplicates: Frames whose number had been seen.
        undecided: Frames with an implausible number, dropped.
        sessions: How often the server began to count, the first time included.
    """

    def __init__(self) -> None:
        self.last: int | None = None
        self.lost = self.late = self.duplicates = self.undecided = self.sessions = 0
        self._at = 0.0
        self._missing: set[int] = set()
        self._strange: list[int] = []

    def classify(self, number: int, now: float, *, models_changed: bool = False) -> Arrival:
        """Say what frame ``number`` is.

        Args:
            number: The server's count.
            now: When it was received, never decreasing [s].
            models_changed: The frame says that the list of assets changed, as the first ones of a new session do.
        """
        if self.last is None:
            return self._begin(number, now)
        ahead = number - self.last
        if 0 < ahead <= LARGEST_GAP:
            self._pass_over(number)
            return self._take(number, now, Arrival.NEXT)
        if number in self._missing:
            self._missing.discard(number)
            self.lost -= 1
            self.late += 1
            return Arrival.LATE
        if ahead == 0:
            self.duplicates += 1
            return Arrival.DUPLICATE
        return self._strange_number(number, now, models_changed)

    def begin_anew(self) -> None:
        """Take the next frame for the first of a new session, whatever its number."""
        self.last = None

    def _take(self, number: int, now: float, arrival: Arrival) -> Arrival:
        self.last, self._at = number, now
        self._strange.clear()
        return arrival

    def _begin(self, number: int, now: float) -> Arrival:
        self.sessions += 1
        self._missing.clear()
        return self._take(number, now, Arrival.NEXT if self.sessions == 1 else Arrival.NEW_SESSION)

    def _pass_over(self, number: int) -> None:
        """Count the numbers between the newest and this one as lost until they turn up."""
        assert self.last is not None
        self.lost += number - self.last - 1
        oldest = number - REORDER_WINDOW
        self._missing.update(range(max(self.last + 1, oldest), number))
        if len(self._missing) > 4 * REORDER_WINDOW:
            self._missing = {each for each in self._missing if each > oldest}

    def _strange_number(self, number: int, now: float, models_changed: bool) -> Arrival:
        """Tell a repeated packet, a corrupt number and a new session apart, by circumstances or later numbers."""
        assert self.last is not None
        if self._strange and not 0 < number - self._strange[-1] <= REORDER_WINDOW:
            self._strange.clear()
        self._strange.append(number)
        near = -REORDER_WINDOW < number - self.last < 0
        wanted = AGREEING_NEAR if near and not models_changed else AGREEING
        if now - self._at > SILENCE or (models_changed and not near) or len(self._strange) >= wanted:
            return self._begin(number, now)
        if near:
            self.duplicates += 1
            return Arrival.DUPLICATE
        self.undecided += 1
        return Arrival.UNDECIDED
