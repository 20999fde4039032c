"""Who sends frames: the first sender is the one, a second makes both doubtful.

Two camera servers in one multicast group, a replay that somebody forgot, a packet made up: which of them shows the
robot cannot be told from the packets. So nothing is believed while two speak.
"""

from __future__ import annotations

from typing import TypeAlias

#: Host and port that a packet came from.
Address: TypeAlias = tuple[str, int]
#: A sender that was silent for so long may have a successor: a restarted server has another port [s].
SUCCESSION_S = 1.0
#: How long frames are doubted after one frame of a stranger; every further one makes it longer by as much [s].
DOUBT_S = 0.15
#: ... up to this [s]; strangers that kept away for as long are forgotten.
LONGEST_DOUBT_S = 1.5


class Senders:
    """Follows where frames come from.

    Attributes:
        first: Where frames are taken from; None before the first.
        stranger: Where others came from last; None if there were none.
        strangers: How many frames of others came.
    """

    def __init__(self) -> None:
        self.first: Address | None = None
        self.stranger: Address | None = None
        self.strangers = 0
        self._heard = self._doubted_until = self._strange_at = float("-inf")
        self._in_a_row = 0

    def admit(self, sender: Address, now: float) -> bool:
        """Tell whether a frame that came from ``sender`` at ``now`` [s] may be looked at."""
        if self.first != sender and now - self._heard > SUCCESSION_S:
            self.first = sender
        if self.first == sender:
            self._heard = now
            return True
        self.object_to(sender, now)
        return False

    def object_to(self, sender: Address, now: float) -> None:
        """Note a frame of a stranger, or what only the server may say."""
        self.strangers += 1
        self._in_a_row = 1 if now - self._strange_at > LONGEST_DOUBT_S else self._in_a_row + 1
        self.stranger, self._strange_at = sender, now
        self._doubted_until = now + min(DOUBT_S * self._in_a_row, LONGEST_DOUBT_S)

    def doubt(self, now: float) -> str:
        """Say why frames cannot be believed at ``now`` [s]; empty if they can."""
        if now >= self._doubted_until or self.first is None or self.stranger is None:
            return ""
        return "from {}:{} while {}:{} sends too".format(*self.first, *self.stranger)
