"""What kinds from elsewhere are made of: bases of their settings, and what flows round the loop.

A plug-in is a pair ``(Settings, build)`` that an experiment names: ``kind: ./my_file.py:NAME``,
``kind: my_package:NAME``, or the name under which an installed package registers it. docs/plugins.md is the guide.

===========  ======================  =================================  ===========================================
section      settings derive from    build takes                        what is built
===========  ======================  =================================  ===========================================
controller   OwnControllerSection    settings, robot                    ``control(estimate, reference)``: speeds
                                                                        (m,) [m/s], or Command, or (Command,
                                                                        ControlInfo); ``ahead`` if it looks further
trajectory   TrajectorySection       settings, robot                    ``duration`` [s], ``position(t)`` (n, 3)
                                                                        [m]; ``normal(t)``, ``drive(t)`` if it has
estimator    EstimatorSection        settings, robot, period [s]        ``update(measured, applied)``: Estimate
plant        PlantSection            settings, robot, period [s], seed  ``read()``: Measurement; ``write(command)``:
                                                                        Command; ``close()``; ``start()``,
                                                                        ``truth()`` if it has
task         TaskSection             settings, targets, rod             ``observe(step)``: list of Event;
                                     diameter [m]                       ``result()``: dict, in JSON
===========  ======================  =================================  ===========================================

Kinds of devices are named by a rig file:

===========  ======================  =================================  ===========================================
cameras      CameraSection           settings, Mounting                 what :class:`Cameras` says
plc          DriveSection            settings, tuple of CableAxis       what :class:`Drives` says
===========  ======================  =================================  ===========================================
"""

from __future__ import annotations

from tcrctl.config.settings import NotNegative, OrOff, Positive, Settings, Vector, quantity
from tcrctl.controller.settings import OwnControllerSection
from tcrctl.errors import ArmingRefusedError, DeviceError, InputError, UntrustworthyDeviceError
from tcrctl.estimator.section import EstimatorSection
from tcrctl.log.event import Event
from tcrctl.plant.rig.devices import (
    Cameras,
    CameraStatus,
    DeviceLimits,
    DriveControl,
    Drives,
    DriveStatus,
    Identity,
    Sighting,
)
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.labelled_markers import LabelledMarkers
from tcrctl.plant.rig.mounting import CableAxis, Mounting
from tcrctl.plant.rig.settings import CameraSection, DriveSection
from tcrctl.plant.settings import PlantSection
from tcrctl.robot.robot import Robot
from tcrctl.signals import (
    Array,
    Command,
    ControlInfo,
    Estimate,
    Measurement,
    RawFrame,
    Reference,
    StepRecord,
    Truth,
)
from tcrctl.task.section import TaskSection
from tcrctl.trajectory.pose_path import EndPose
from tcrctl.trajectory.section import TrajectorySection

__all__ = [
    "ArmingRefusedError",
    "Array",
    "CableAxis",
    "CameraSection",
    "CameraStatus",
    "Cameras",
    "Command",
    "ControlInfo",
    "DeviceError",
    "DeviceLimits",
    "DriveControl",
    "DriveSection",
    "DriveStatus",
    "Drives",
    "EndPose",
    "Estimate",
    "EstimatorSection",
    "Event",
    "Finding",
    "Identity",
    "InputError",
    "LabelledMarkers",
    "Measurement",
    "Mounting",
    "NotNegative",
    "OrOff",
    "OwnControllerSection",
    "PlantSection",
    "Positive",
    "RawFrame",
    "Reference",
    "Robot",
    "Settings",
    "Sighting",
    "StepRecord",
    "TaskSection",
    "TrajectorySection",
    "Truth",
    "UntrustworthyDeviceError",
    "Vector",
    "quantity",
]
