"""What every trajectory offers, and which kinds there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Reference
from tcrctl.trajectory.drive_settings import DrivesSettings
from tcrctl.trajectory.drives import build_drives
from tcrctl.trajectory.excitation import build_excitation
from tcrctl.trajectory.excitation_settings import ExcitationSettings
from tcrctl.trajectory.hold import build_hold
from tcrctl.trajectory.own import OwnTrajectory
from tcrctl.trajectory.pose_settings import RevolutionSettings, ScanSettings, WaypointsSettings
from tcrctl.trajectory.revolution import build_revolution
from tcrctl.trajectory.scan import build_scan
from tcrctl.trajectory.section import TrajectorySection
from tcrctl.trajectory.settings import HoldSettings, StrokesSettings, TrajectorySettings
from tcrctl.trajectory.strokes import build_strokes
from tcrctl.trajectory.table import build_table
from tcrctl.trajectory.table_settings import TableSettings
from tcrctl.trajectory.targets import Targets, with_targets
from tcrctl.trajectory.waypoints import build_waypoints


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


@runtime_checkable
class Driven(Protocol):
    """What a trajectory offers that gives drive lengths beside the end pose that goes with them."""

    def drive(self, t: Array) -> Array | None:
        """Return drive lengths at times t (n,) [s] as (n, m) [m], or None if it gives none."""
        ...


#: Section and builder of every ``trajectory.kind``.
KINDS: Final[Mapping[str, tuple[type[TrajectorySection], Callable[[Any, Robot], Trajectory]]]] = {
    "strokes": (StrokesSettings, build_strokes),
    "hold": (HoldSettings, build_hold),
    "waypoints": (WaypointsSettings, build_waypoints),
    "revolution": (RevolutionSettings, build_revolution),
    "scan": (ScanSettings, build_scan),
    "drives": (DrivesSettings, build_drives),
    "excitation": (ExcitationSettings, build_excitation),
    "table": (TableSettings, build_table),
}

NO_TARGETS: Targets = {}


def build_trajectory(settings: TrajectorySettings, robot: Robot, targets: Targets = NO_TARGETS) -> Trajectory:
    """Build the trajectory that a ``trajectory:`` section describes.

    Args:
        settings: The checked section.
        robot: The robot that the controller knows; paths start at its rest pose.
        targets: The poses that the section asks for by name.

    Raises:
        NoEquilibriumError: If drive lengths are given with which the robot has no stable shape.
        InputError: If one from elsewhere cannot be built.
    """
    plugin = plugin_of(settings)
    if plugin is not None:
        return OwnTrajectory(with_targets(settings, targets), plugin, robot)
    _, build = KINDS[settings.kind]
    return build(with_targets(settings, targets), robot)


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
    drives = drives_of(trajectory, times[1:2])
    return Reference(
        t=t,
        position=position[0],
        normal=None if normal is None else normal[0],
        ahead_position=position[1:],
        ahead_normal=None if normal is None else normal[1:],
        drive=None if drives is None else drives[0],
    )


def drives_of(trajectory: Trajectory, t: Array) -> Array | None:
    """Return drive lengths at times t (n,) [s] as (n, m) [m], or None if the trajectory gives none."""
    return trajectory.drive(t) if isinstance(trajectory, Driven) else None
