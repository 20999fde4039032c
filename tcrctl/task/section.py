"""What every ``task:`` section from elsewhere can be asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tcrctl.config.settings import Settings

if TYPE_CHECKING:  # it needs numpy, and what lists experiments does not
    from tcrctl.trajectory.pose_path import EndPose


class TaskSection(Settings):
    """Base of tasks from elsewhere: names no targets and no results unless it says so."""

    def targets(self) -> Mapping[str, EndPose]:
        """Return the poses that a trajectory can go to, by name."""
        return {}

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names that a trajectory can go to."""
        return tuple(self.targets())

    @property
    def result_names(self) -> tuple[str, ...]:
        """Names of the numbers and flags in the result that a criterion may use, each with its unit at the end."""
        return ()
