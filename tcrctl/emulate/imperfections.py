"""What one emulated robot, its drives and its markers have of real ones; see docs/reality.md."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tcr_hardware.servo import ServoSettings
from tcrctl.plant.cameras import draw_cameras
from tcrctl.plant.drives import servo_settings
from tcrctl.plant.own_robot import own_description
from tcrctl.plant.realistic import as_drawn
from tcrctl.plant.reality_settings import CameraSettings, Level
from tcrctl.plant.rig.settings import MountedRobot
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.robot.description import load_robot
from tcrctl.robot.module import RING
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array


class Imperfections:
    """Drawn once, by the seed.

    Attributes:
        plant: Settings of a simulated plant that is the same.
        robot: The robot that hangs there, before other material and other strings.
        lost_markers: Share of markers that a frame does not have.
        lost_frames: Share of frames that do not come.
    """

    def __init__(self, name: str, robot: Robot, mismatch: Mismatch | None, level: Level, seed: int) -> None:
        """Draw them.

        Args:
            name: Name of the robot's file.
            robot: As the controller knows it.
            mismatch: Factors on its material.
            level: Size of everything else.
            seed: Of the draw.

        Raises:
            NoEquilibriumError: If that robot has no stable shape.
        """
        plant = SimulatedSettings(kind="simulated", mismatch=mismatch, realistic=level)
        self.plant = plant = as_drawn(plant, robot.n_cables, seed)
        self.robot, self._names = robot, robot.cable_names
        if plant.scatter is not None:
            self.robot = build_robot(own_description(plant, load_robot(name), robot, seed))
        cameras = plant.cameras or CameraSettings()
        self._draw = draw_cameras(cameras, RING * robot.n_modules, seed)
        self.lost_markers, self.lost_frames = cameras.lost_markers, cameras.lost_frames

    def servos(self, mounted: MountedRobot, axes: int) -> tuple[ServoSettings, ...]:
        """Return the drives of so many axes; those without a cable are as they come."""
        servos = [ServoSettings()] * axes
        if self.plant.drives is not None:
            drawn = servo_settings(self.plant.drives, len(self._names))
            for name, servo in zip(self._names, drawn, strict=True):
                cable = mounted.cables[name]
                servos[cable.axis - 1] = replace(servo, zero_error_um=cable.sign * servo.zero_error_um)
        return tuple(servos)

    def markers(self, rings: Array) -> Array:
        """Return the markers of ring nodes, both [m], in the frame that is off; those of the base come first."""
        markers = np.vstack([rings[:RING], self._draw.beside(rings[RING:])])
        return self._draw.in_frame(markers)
