"""A plant to rehearse with: what may happen to any, so that no kernel is compiled, or loaded, in a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from tcrctl.plant.settings import PlantSettings, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.module import RING
from tcrctl.robot.robot import Robot
from tcrctl.signals import Measurement

#: Markers that the cameras lose, frame by frame: none, one, a ring, none.
LOST: Final = (0, 1, RING, 0)


class RehearsalPlant(SimulatedPlant):
    """Ideal parts that run through the kernels of another plant, before cameras that lose markers."""

    def __init__(self, settings: PlantSettings, robot: Robot, period: float, seed: int) -> None:
        """Take what a plant will be like, the robot, the control period [s] and a seed.

        Raises:
            NoEquilibriumError: If the robot has no stable shape.
        """
        friction = settings.friction if isinstance(settings, SimulatedSettings) else None
        super().__init__(SimulatedSettings(kind="simulated", friction=friction), robot, period, seed)
        self._frames = 0

    def read(self) -> Measurement:
        """Return the next frame; after the last of them they begin anew."""
        frame = super().read()
        lost = LOST[self._frames % len(LOST)]
        self._frames += 1
        valid = frame.valid.copy()
        valid[:lost] = False
        return replace(frame, valid=valid)
