"""What every ``trajectory:`` section can be asked, whatever its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, NamedTuple, Self

from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import Settings
from tcrctl.trajectory.values import Vector


class Placed(NamedTuple):
    """A named pose as a section writes it.

    Attributes:
        position_mm: Place in the world frame [mm].
        normal: Unit end normal, or None if the orientation is free.
    """

    position_mm: Vector
    normal: Vector | None


class TrajectorySection(Settings):
    """Base of all kinds: most of them ask for no targets and give no drive lengths."""

    #: Whether drive lengths go with the end pose.
    gives_drives: ClassVar[bool] = False

    def named_targets(self) -> Iterator[tuple[Keys, str]]:
        """Yield place in the section and name of every target that it asks for."""
        yield from ()

    def with_targets(self, poses: Mapping[str, Placed]) -> Self:
        """Return the section with the poses of its targets filled in; all that it names are known."""
        del poses
        return self

    def drives_named(self) -> Iterator[tuple[Keys, tuple[float, ...]]]:
        """Yield place in the section and drive lengths [mm] wherever it gives some."""
        yield from ()

    def misfits(self, period: float) -> Iterator[Finding]:
        """Yield place and message of what does not go with a control period [s]."""
        del period
        yield from ()
