"""Kinds are tables: every kind that a file may name has its section and its builder in one line."""

from __future__ import annotations

import pytest

from tcrctl.config.unions import kind_of, models_in
from tcrctl.controller import controller
from tcrctl.controller.settings import ControllerSettings
from tcrctl.estimator import estimator
from tcrctl.estimator.settings import EstimatorSettings
from tcrctl.experiment import prepare
from tcrctl.plant.rig import modbus_drives
from tcrctl.plant.rig.settings import Dynamixel, MountedRobot
from tcrctl.plant.settings import PlantSettings
from tcrctl.task import task
from tcrctl.task.settings import TaskSettings
from tcrctl.trajectory import trajectory
from tcrctl.trajectory.settings import TrajectorySettings

TABLES = {
    "controller": (controller.KINDS, ControllerSettings),
    "trajectory": (trajectory.KINDS, TrajectorySettings),
    "estimator": (estimator.KINDS, EstimatorSettings),
    "plant": (prepare.PLANTS, PlantSettings),
    "task": (task.KINDS, TaskSettings),
    "plc": (
        {**modbus_drives.LINKS, "dynamixel": (Dynamixel, None)},
        MountedRobot.model_fields["plc"].annotation,
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_the_table_of_kinds_has_what_a_file_may_say_and_nothing_else(name):
    table, union = TABLES[name]
    assert {kind: line[0] for kind, line in table.items()} == {kind_of(m): m for m, _ in models_in(union)}
