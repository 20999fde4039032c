"""What a part of the loop keeps from step to step, so that the loop can be linearised about any of its states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple, Protocol, runtime_checkable

from tcrctl.signals import Array


class Kept(NamedTuple):
    """One array of a part's memory.

    Attributes:
        values: The array itself, not a copy: what is added to it changes the part.
        scale: Size of a change that is small for the robot and large for rounding, in the unit of the array.
        blind: Unit vector along which a change of the array has no effect at all, or None.
    """

    values: Array
    scale: float
    blind: Array | None = None


#: Scales of what moves at about one cycle per second by about a millimetre.
POSITION: Final = 1e-3
SPEED: Final = 6e-3
ACCELERATION: Final = 4e-2
#: Of a unit vector at the end of a robot half a metre long.
NORMAL: Final = 2e-3
TENSION: Final = 0.1


@runtime_checkable
class Remembers(Protocol):
    """A part that can show its memory."""

    def memory(self) -> Mapping[str, Kept]:
        """Return every array that the next step depends on, by name; an iteration's start may be left out."""
        ...
