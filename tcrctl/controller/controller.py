"""What the loop needs of a controller, and which kinds there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.instantaneous import InstantaneousOptimalControl
from tcrctl.controller.kinematic import Kinematic
from tcrctl.controller.literal import LiteralIoc
from tcrctl.controller.open_loop import OpenLoop
from tcrctl.controller.settings import ControllerSettings, KinematicSettings, OpenLoopSettings
from tcrctl.memory import Kept
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, ControlInfo, Estimate, Reference


class Controller(Protocol):
    """Turns estimates and references into commands; knows no clock but the times in its arguments.

    Attributes:
        ahead: Instants after the step at which it wants the reference (n,) [s].
    """

    ahead: Array

    def control(self, estimate: Estimate, reference: Reference) -> tuple[Command, ControlInfo]:
        """Command for the coming period, within speed and stroke limits, and how it was found."""
        ...

    def sharpen(self) -> None:
        """From now on solve to rounding: what a tick tolerates is a step in the map that is to be linearised."""
        ...

    def memory(self) -> Mapping[str, Kept]:
        """What the next command depends on; see :class:`tcrctl.memory.Remembers`."""
        ...

    def inner_map(self) -> InnerMap | None:
        """The iteration of the last step; None if there is none, or it did not end in a solution."""
        ...


def build_controller(settings: ControllerSettings, robot: Robot) -> Controller:
    """Build the controller of a ``controller:`` section."""
    if isinstance(settings, OpenLoopSettings):
        return OpenLoop(settings, robot)
    if isinstance(settings, KinematicSettings):
        return Kinematic(settings, robot)
    if settings.prediction == "literal":
        return LiteralIoc(settings, robot)
    return InstantaneousOptimalControl(settings, robot)
