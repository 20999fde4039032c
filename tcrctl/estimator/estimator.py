"""What the loop needs of a state estimator, and which kinds there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from tcrctl.config.settings import Settings
from tcrctl.estimator.drives import BelievedDrives
from tcrctl.estimator.exact import TrueState, build_exact
from tcrctl.estimator.own import OwnEstimator
from tcrctl.estimator.passive_observer import build_observer
from tcrctl.estimator.settings import EstimatorSettings, ExactSettings, PassiveObserverSettings
from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.robot import Robot
from tcrctl.signals import Command, Estimate, Measurement


class Estimator(Protocol):
    """Turns measurements into states of the robot model."""

    def sharpen(self) -> None:
        """Search nothing any more, so that the loop can be linearised."""
        ...

    def update(self, measured: Measurement, applied: Command) -> Estimate:
        """Return the state at the time of ``measured``, ``applied`` being the command since the last update."""
        ...


Builder = Callable[[Any, Robot, float, TrueState | None, BelievedDrives], Estimator]

#: Section and builder of every ``estimator.kind``.
KINDS: Final[Mapping[str, tuple[type[Settings], Builder]]] = {
    "passive_observer": (PassiveObserverSettings, build_observer),
    "exact": (ExactSettings, build_exact),
}


def build_estimator(
    settings: EstimatorSettings,
    robot: Robot,
    period: float,
    state: TrueState | None,
    drives: BelievedDrives | None = None,
) -> Estimator:
    """Build the estimator of an ``estimator:`` section.

    Args:
        settings: The section.
        robot: The robot that the controller knows.
        period: Control period [s].
        state: True positions and velocities of a simulated plant, None on a rig.
        drives: Where the drives are believed to be, moved on by the estimator; None if they report it.

    Raises:
        InputError: If the exact state is asked for where there is none, or one from elsewhere cannot be built.
    """
    plugin = plugin_of(settings)
    if plugin is not None:
        return OwnEstimator(settings, plugin, robot, period)
    _, build = KINDS[settings.kind]
    return build(settings, robot, period, state, drives or BelievedDrives(None, 0.0, "encoder", period))
