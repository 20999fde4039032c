"""What the loop needs of a controller, and which kinds there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol, cast

from tcrctl.controller.instantaneous import InstantaneousOptimalControl
from tcrctl.controller.kinematic import Kinematic
from tcrctl.controller.literal import LiteralIoc
from tcrctl.controller.open_loop import OpenLoop
from tcrctl.controller.own import OwnController
from tcrctl.controller.plan import Planner
from tcrctl.controller.settings import (
    ControllerSection,
    ControllerSettings,
    IocSettings,
    KinematicSettings,
    OpenLoopSettings,
    OwnControllerSection,
)
from tcrctl.controller.shell import Shell
from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference


class Controller(Protocol):
    """Turns estimates and references into commands; knows no clock but the times in its arguments.

    Attributes:
        ahead: Instants after the step at which it wants the reference (n,) [s].
    """

    ahead: Array

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Return the command for the coming period, within speed and stroke limits, and how it was found."""
        ...


def _ioc(settings: IocSettings, robot: Robot) -> Controller:
    return Shell(settings, robot, PLANNERS[settings.prediction.kind](settings, robot))


def _kinematic(settings: KinematicSettings, robot: Robot) -> Controller:
    return Shell(settings, robot, Kinematic(settings, robot))


#: What finds the inputs of ``kind: ioc``, for every ``prediction.kind``.
PLANNERS: Final[Mapping[str, Callable[[IocSettings, Robot], Planner]]] = {
    "multi_step": InstantaneousOptimalControl,
    "one_step": InstantaneousOptimalControl,
    "literal": LiteralIoc,
}
#: Settings and builder of every ``controller.kind``.
KINDS: Final[Mapping[str, tuple[type[ControllerSection], Callable[[Any, Robot], Controller]]]] = {
    "ioc": (IocSettings, _ioc),
    "kinematic": (KinematicSettings, _kinematic),
    "open_loop": (OpenLoopSettings, OpenLoop),
}


def build_controller(settings: ControllerSettings, robot: Robot) -> Controller:
    """Build the controller of a ``controller:`` section.

    Raises:
        InputError: If one from elsewhere cannot be built.
    """
    plugin = plugin_of(settings)
    if plugin is not None:
        return OwnController(cast(OwnControllerSection, settings), plugin, robot)
    _, build = KINDS[settings.kind]
    return build(settings, robot)
