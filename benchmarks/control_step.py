"""Cost of one control step of tcr700 in pose mode: estimator and controller, section by section, and as it grows.

    python benchmarks/control_step.py [--seconds 20] [--modules 26]

The robot follows a circle with a tilted end on the mismatched, noisy plant; times are CPU times of this thread. The
same with more modules, cables to the last and to the ring at the same part of the length, tells how cost grows.
"""

from __future__ import annotations

import argparse
import os
import resource
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.setdefault("NUMBA_OPT", "1")

import numpy as np
from rich.console import Console
from rich.table import Table

from tcrctl.controller.controller import build_controller
from tcrctl.controller.settings import CostWeights, IocSettings
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array, Command, Reference

PERIOD = 0.05


def circle(robot: Robot, t: Array) -> tuple[Array, Array]:
    """End positions (n, 3) [m] and normals (n, 3): 50 mm radius, 15 deg tilt, 20 s per turn, eased in over 4 s."""
    blend = np.clip(t / 4.0, 0.0, 1.0)
    blend = blend**4 * (35.0 - 84.0 * blend + 70.0 * blend**2 - 20.0 * blend**3)
    angle, tilt = 2.0 * np.pi * t / 20.0, np.radians(15.0) * blend
    out = np.stack([np.cos(angle), np.sin(angle), 0.0 * t], axis=1)
    position = robot.rest_position + 0.05 * blend[:, None] * out + np.outer(blend, [0.0, 0.0, 0.04])
    return position, np.cos(tilt)[:, None] * [0.0, 0.0, 1.0] - np.sin(tilt)[:, None] * out


def stretched(count: int) -> Robot:
    """Return tcr700 with so many modules."""
    known = load_robot("tcr700")
    longer = count / known.modules.count
    routes = (r.model_copy(update={"to_ring": round(r.to_ring * longer)}) for r in known.cables.routes)
    changes = {
        "modules": known.modules.model_copy(update={"count": count}),
        "cables": known.cables.model_copy(update={"routes": tuple(routes)}),
        "tip": known.tip.model_copy(update={"ring": count}),
        "stroke_mm": tuple(longer * end for end in known.stroke_mm),
    }
    return build_robot(known.model_copy(update=changes))


def measure(robot: Robot, seconds: float) -> tuple[Array, Array]:
    """Return the times of estimator and controller [ms], one per step."""
    plant_settings = SimulatedSettings(
        kind="simulated",
        noise_um=50,
        latency_ms=10,
        mismatch=Mismatch(springs_youngs_modulus=0.7, density=1.2),
    )
    plant = SimulatedPlant(plant_settings, robot, PERIOD, seed=1)
    observer = build_estimator(PassiveObserverSettings(kind="passive_observer"), robot, PERIOD, None)
    weights = CostWeights(position=7.2e4, normal=44.0, twist=1e-3)
    controller = build_controller(IocSettings(kind="ioc", output="pose", weights=weights), robot)
    applied, times = Command(np.zeros(6), np.zeros(6)), []
    for k in range(round(seconds / PERIOD)):
        measured, t = plant.read(), k * PERIOD
        position, normal = circle(robot, np.concatenate([[t], t + controller.ahead]))
        reference = Reference(t, position[0], normal[0], position[1:], normal[1:])
        t0 = time.thread_time()
        estimate = observer.update(measured, applied)
        t1 = time.thread_time()
        wanted, info = controller.control(estimate, reference)
        times.append((t1 - t0, time.thread_time() - t1))
        assert info.converged, info.reason
        applied = plant.write(wanted)
    return 1e3 * np.array(times).T[:, 5:]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time [s]")
    parser.add_argument("--modules", type=int, default=26, help="modules of the other robot")
    given = parser.parse_args()
    robots = [build_robot(load_robot("tcr700")), stretched(given.modules)]
    medians, table = (
        [],
        Table("modules", "section", "p50 ms", "p99 ms", "max ms", title="control step, pose, 20 Hz"),
    )
    for robot in robots:
        estimate, control = measure(robot, given.seconds)
        for name, values in (("estimator", estimate), ("controller", control), ("both", estimate + control)):
            p50, p99 = np.percentile(values, [50, 99])
            table.add_row(str(robot.n_modules), name, f"{p50:.3f}", f"{p99:.3f}", f"{values.max():.3f}")
        medians.append(float(np.median(estimate + control)))
    console = Console()
    console.print(table)
    console.print(f"{given.modules} / 13 modules: {medians[1] / medians[0]:.2f} (bar 2.2 for 26)")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    console.print(f"{estimate.shape[0]} steps, peak memory {peak:.0f} MiB")


if __name__ == "__main__":
    main()
