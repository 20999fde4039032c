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
===========  ======================  =================================  ===========================================
"""

from __future__ import annotations

from tcrctl.config.settings import NotNegative, OrOff, Positive, Settings, Vector, quantity
from tcrctl.controller.settings import OwnControllerSection
from tcrctl.estimator.section import EstimatorSection
from tcrctl.plant.settings import PlantSection
from tcrctl.robot.robot import Robot
from tcrctl.signals import (
    Array,
    Command,
    ControlInfo,
    Estimate,
    Measurement,
    Reference,
    Truth,
)
from tcrctl.trajectory.section import TrajectorySection

__all__ = [
    "Array",
    "Command",
    "ControlInfo",
    "Estimate",
    "EstimatorSection",
    "Measurement",
    "NotNegative",
    "OrOff",
    "OwnControllerSection",
    "PlantSection",
    "Positive",
    "Reference",
    "Robot",
    "Settings",
    "TrajectorySection",
    "Truth",
    "Vector",
    "quantity",
]
