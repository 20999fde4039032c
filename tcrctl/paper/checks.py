"""Measurements that are no experiments: Table II by statics, the time of a plant step."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from tcrctl.paper.table2 import measured_displacements, model_displacements
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Command

PERIOD: Final = 0.05
#: Simulated time over which steps are measured [s], and the speed at which the drives swing [m/s].
MEASURED_S: Final = 5.0
SWING: Final = 0.02


def table2() -> dict[str, Any]:
    """Return the distance of the end displacements of tcr700 from those measured, Table II of [TCR]."""
    measured = measured_displacements()
    found = model_displacements(build_robot(load_robot("tcr700")))
    errors = {name: 1e3 * float(np.linalg.norm(found[name] - measured[name])) for name in measured}
    return {"error_mm": errors, "mean_error_mm": float(np.mean(list(errors.values())))}


def plant_step() -> dict[str, Any]:
    """Return the wall time per internal step of 1 ms of the simulated tcr700 while its drives swing."""
    robot = build_robot(load_robot("tcr700"))
    plant = SimulatedPlant(SimulatedSettings(kind="simulated", step_ms=1.0), robot, PERIOD, seed=0)
    per_write = round(PERIOD / 1e-3)
    times = []
    for k in range(1 + round(MEASURED_S / PERIOD)):
        speed = SWING * np.sin(2.0 * np.pi * k * PERIOD / MEASURED_S + np.arange(robot.n_cables))
        command = Command(speed, plant.read().drive + PERIOD * speed)
        begin = time.perf_counter()
        plant.write(command)
        times.append(1e3 * (time.perf_counter() - begin) / per_write)
    plant.close()
    p50, p99 = np.quantile(times[1:], (0.5, 0.99))  # the first one loads the kernels
    return {"step_ms": {"p50": float(p50), "p99": float(p99)}, "steps": per_write * (len(times) - 1)}


CHECKS: Final[Mapping[str, Callable[[], dict[str, Any]]]] = {"table2": table2, "plant_step": plant_step}
