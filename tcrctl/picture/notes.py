"""What is not believed is told once by ring, not in every frame; again only after it has been well for a while."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tcrctl.picture.suspects import Suspect, ring_name

#: What has been well for so long is believed again [s].
WELL: Final = 1.0
#: So many suspects are named in a doubt.
NAMED: Final = 3


class PictureNotes:
    """Reports what begins and ceases to be left out."""

    def __init__(self, report: Callable[[str, str, str], None], period: float) -> None:
        """Take where events go (kind, level, text) and the control period [s]."""
        self._report, self._period = report, period
        self._well: dict[int, float] = {}
        self._held = False

    def note(self, suspects: Sequence[Suspect], *, held: bool) -> str:
        """Take the suspects of one frame, and whether the drives are held for them; returns why, or nothing."""
        rings = {suspect.ring for suspect in suspects}
        for suspect in suspects:
            if suspect.ring not in self._well:
                self._report("picture", "warning", f"{suspect.name} is not believed: {suspect.why}")
            self._well[suspect.ring] = 0.0
        for ring in [ring for ring in self._well if ring not in rings]:
            self._well[ring] += self._period
            if self._well[ring] > WELL:
                del self._well[ring]
                self._report("picture", "info", f"{ring_name(ring)} is believed again")
        why = _why(suspects) if held else ""
        if held != self._held:
            text = f"the drives are held: {why}" if held else "the drives are not held any more"
            self._report("picture", "warning" if held else "info", text)
        self._held = held
        return why


def _why(suspects: Sequence[Suspect]) -> str:
    told = "; ".join(f"{suspect.name} is not believed, {suspect.why}" for suspect in suspects[:NAMED])
    more = len(suspects) - NAMED
    return f"{told}; and {more} more" if more > 0 else told
