"""What every trajectory offers, and which kinds there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from ..signals import Array, Reference
from .hold import build_hold
from .revolution import build_revolution
from .scan import build_scan
from .settings import TrajectorySettings
from .strokes import build_strokes
from .waypoints import build_waypoints


class Trajectory(Protocol):
    """Wanted end pose over time; any time may be asked for, beyond the ends it stands still."""

    @property
    def duration(self) -> float:
        """Time from the first to the last motion, rests included [s]."""
        ...

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m], world frame."""
        ...

    def normal(self, t: Array) -> Array | None:
        """Return unit end normals at times t (n,) [s] as (n, 3), or None if the orientation is free."""
        ...


# the settings type of each builder belongs to its key; TrajectorySettings has checked that pairing
BUILDERS: Mapping[str, Callable[[Any, Array, Array], Trajectory]] = {
    "strokes": build_strokes,
    "hold": build_hold,
    "waypoints": build_waypoints,
    "revolution": build_revolution,
    "scan": build_scan,
}


def build_trajectory(settings: TrajectorySettings, rest_position: Array, rest_normal: Array) -> Trajectory:
    """Build the trajectory that a ``trajectory:`` section describes.

    Args:
        settings: The checked section.
        rest_position: End position of the robot at rest (3,) [m].
        rest_normal: End normal of the robot at rest (3,).
    """
    return BUILDERS[settings.kind](settings, rest_position, rest_normal)


def sample_reference(trajectory: Trajectory, t: float, ahead_t: Array) -> Reference:
    """Ask a trajectory for one control step.

    Args:
        trajectory: Any trajectory.
        t: Time of the step [s].
        ahead_t: Prediction instants, absolute times (n,) [s].

    Returns:
        The target at ``t`` and at the prediction instants.
    """
    times = np.concatenate(([t], ahead_t))
    position, normal = trajectory.position(times), trajectory.normal(times)
    if normal is None:
        return Reference(t, position[0], None, position[1:], None)
    return Reference(t, position[0], normal[0], position[1:], normal[1:])
