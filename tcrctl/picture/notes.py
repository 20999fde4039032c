"""What is not believed is told once, not in every frame, and told again when it has been well for a while."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tcrctl.picture.suspects import Suspect

#: What has been well for so long is believed again [s].
WELL: Final = 1.0
#: So many suspects are named in a doubt.
NAMED: Final = 3


class PictureNotes:
    """Reports what begins and ceases to be left out."""

    def __init__(self, report: Callable[[str, str, str], None], period: float) -> None:
        """Take where events go (kind, level, text) and the control period [s]."""
        self._report, self._period = report, period
        self._well: dict[str, float] = {}
        self._held = False

    def note(self, suspects: Sequence[Suspect], *, held: bool) -> str:
        """Take the suspects of one frame, and whether the drives are held for them; returns why, or nothing."""
        names = {suspect.name for suspect in suspects}
        for suspect in suspects:
            if suspect.name not in self._well:
                self._report("picture", "warning", f"{suspect.name} is not believed: {suspect.why}")
            self._well[suspect.name] = 0.0
        for name in [name for name in self._well if name not in names]:
            self._well[name] += self._period
            if self._well[name] > WELL:
                del self._well[name]
                self._report("picture", "info", f"{name} is believed again")
        why = _why(suspects) if held else ""
        if held != self._held:
            text = f"the drives are held: {why}" if held else "the picture is believed again"
            self._report("picture", "warning" if held else "info", text)
        self._held = held
        return why


def _why(suspects: Sequence[Suspect]) -> str:
    told = "; ".join(f"{suspect.name} is not believed, {suspect.why}" for suspect in suspects[:NAMED])
    more = len(suspects) - NAMED
    return f"{told}; and {more} more" if more > 0 else told
