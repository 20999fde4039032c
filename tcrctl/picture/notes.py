"""What is not believed is told once by ring, not in every frame; again only after it has been well for a while."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tcrctl.picture.suspects import Suspect, named, ring_name

#: What has been well for so long is believed again [s].
WELL: Final = 1.0


class PictureNotes:
    """Reports what begins and ceases to be left out."""

    def __init__(self, report: Callable[[str, str, str], None]) -> None:
        """Take where events go (kind, level, text)."""
        self._report = report
        self._last_ill: dict[int, float] = {}
        self._held = False

    def note(self, suspects: Sequence[Suspect], now: float, *, held: bool) -> str:
        """Take the suspects of one frame; returns why the drives are held, or nothing.

        Args:
            suspects: What is not believed.
            now: Time [s].
            held: Whether the drives are held for them.
        """
        if not (suspects or held or self._held or self._last_ill):
            return ""
        rings = {suspect.ring for suspect in suspects}
        for suspect in suspects:
            if suspect.ring not in self._last_ill:
                self._report("picture", "warning", suspect.said())
            self._last_ill[suspect.ring] = now
        for ring in [ring for ring, at in self._last_ill.items() if ring not in rings and now - at > WELL]:
            del self._last_ill[ring]
            self._report("picture", "info", f"{ring_name(ring)} is believed again")
        why = "; ".join(named(suspects, ", ")) if held else ""
        if held != self._held:
            text = f"the drives are held: {why}" if held else "the drives are not held any more"
            self._report("picture", "warning" if held else "info", text)
        self._held = held
        return why
