"""Random feasible pose paths on the mismatched, noisy, late plant: does the controller hold where nobody tuned it?

    python benchmarks/random_paths.py [--paths 50] [--seed 1] [--jobs N] [--json]

A path goes through two to four poses of the nominal robot at rest with random drives, straight and with the normal
on a great circle, in 20 to 60 s. A path that the feasibility check refuses, for the nominal robot or for the plant,
whose weaker springs cannot hold every pose with taut cables, is drawn again and counted. Exit code 1 if a run
diverges.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import simulate
from rich.console import Console
from rich.table import Table

from tcrctl.errors import InfeasibleError, NoEquilibriumError
from tcrctl.experiment.feasibility import DriveLimits, check_feasibility
from tcrctl.experiment.prepare import build_plant, plan, prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.robot import pose
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array
from tcrctl.trajectory.pose_settings import WaypointSettings, WaypointsSettings

SHORTEST_S, LONGEST_S = 20.0, 60.0
#: Tensions of the nominal robot at a waypoint [N]; the weaker springs of the plant need some room.
TENSIONS = (2.0, 30.0)
#: What the plant must be able to do along the whole path: the limits that the feasibility check has for the model.
LIMITS = DriveLimits(speed=0.05, floor=1.0, ceiling=60.0)


@dataclass(frozen=True)
class Walk:
    """One path and how the robot followed it."""

    seed: int
    refused: int
    duration_s: float
    outcome: simulate.Outcome


def random_drives(random: np.random.Generator) -> Array:
    """Drive lengths (6,) [m]: shortening, bending of the whole robot, bending of its upper segment."""
    short = random.uniform(0.0, 0.035)
    angles = np.radians(60.0 * np.arange(6))
    whole, upper = random.uniform(0.0, 0.05), random.uniform(0.0, 0.03)
    bend = np.where(np.arange(6) % 2 == 0, whole, 0.6 * whole) * np.cos(
        angles - random.uniform(0.0, 2 * np.pi)
    )
    bend += np.where(np.arange(6) % 2 == 1, upper, 0.0) * np.cos(angles - random.uniform(0.0, 2 * np.pi))
    return np.where(np.arange(6) % 2 == 0, short, 0.6 * short) + bend


def random_pose(random: np.random.Generator, robot: Robot) -> WaypointSettings:
    """Draw a pose that the nominal robot takes at rest with all cables taut."""
    while True:
        drive = random_drives(random)
        try:
            held = equilibrium(robot.model, drive, robot.weight, robot.rest.q)
        except NoEquilibriumError:
            continue
        if TENSIONS[0] <= held.tension.min() and held.tension.max() <= TENSIONS[1]:
            offset = 1e3 * (pose.position(held.q, robot.tip) - robot.rest_position)
            normal = pose.normal(held.q, robot.tip)
            return WaypointSettings(offset_mm=tuple(offset.tolist()), normal=tuple(normal.tolist()))


def random_path(random: np.random.Generator, robot: Robot) -> WaypointsSettings:
    """Return the waypoints and limits of the motion."""
    return WaypointsSettings(
        kind="waypoints",
        points=tuple(random_pose(random, robot) for _ in range(random.integers(2, 5))),
        speed_limit_mm_s=random.uniform(10.0, 40.0),
        acceleration_limit_mm_s2=random.uniform(10.0, 30.0),
        angular_speed_limit_deg_s=random.uniform(4.0, 12.0),
        angular_acceleration_limit_deg_s2=random.uniform(4.0, 10.0),
        ramp_s=random.uniform(1.5, 3.0),
        settle_s=3.0,
    )


def walk(seed: int) -> Walk:
    """Draw paths until one is feasible and of the right duration, and run it."""
    random, robot = np.random.default_rng(seed), build_robot(load_robot("tcr700"))
    base, refused = load_spec("fixed_point_rotation", (f"seed={seed}",)), 0
    while True:
        spec = base.spec.model_copy(update={"trajectory": random_path(random, robot)})
        experiment = prepare(replace(base, spec=spec))
        duration = experiment.trajectory.duration
        if not SHORTEST_S <= duration <= LONGEST_S:
            continue
        try:
            plan(experiment)
            check_feasibility(experiment.trajectory, build_plant(experiment)[0].robot, LIMITS)
        except InfeasibleError:
            refused += 1
            continue
        return Walk(seed, refused, duration, simulate.run(experiment))


def main() -> int:
    """Run all paths and print the distribution."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", type=int, default=50, help="number of paths")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first one")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of tables")
    options = parser.parse_args()
    walks = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for done in pool.map(walk, range(options.seed, options.seed + options.paths)):
            walks.append(done)
            text = done.outcome.failure or f"{done.outcome.part('position_error_mm'):.2f} mm"
            print(f"path {done.seed}, {done.duration_s:.0f} s: {text}", file=sys.stderr, flush=True)
    diverged = [w.seed for w in walks if w.outcome.failure]
    numbers = {
        "largest position error, mm": [w.outcome.part("position_error_mm") for w in walks],
        "rms position error, mm": [w.outcome.part("position_error_mm", "rms") for w in walks],
        "largest orientation error, deg": [w.outcome.part("orientation_error_deg") for w in walks],
        "smallest tension, N": [w.outcome.part("tension_n", "min") for w in walks],
        "unconverged steps": [float(w.outcome.measures.unconverged_steps) for w in walks],
        "duration, s": [w.duration_s for w in walks],
    }
    quantiles = {name: np.nanquantile(values, [0, 0.5, 0.9, 1]).tolist() for name, values in numbers.items()}
    refused = sum(w.refused for w in walks)
    if options.json:
        print(
            json.dumps(
                {"paths": len(walks), "diverged": diverged, "refused": refused, "quantiles": quantiles}
            )
        )
        return int(bool(diverged))
    table = Table("", "least", "median", "90 %", "greatest", title=f"{len(walks)} random pose paths")
    for name, values in quantiles.items():
        table.add_row(name, *(f"{value:.3g}" for value in values))
    console = Console()
    console.print(table)
    console.print(
        f"diverged: {diverged or 'none'}; {refused} paths were refused as infeasible and drawn again"
    )
    return int(bool(diverged))


if __name__ == "__main__":
    sys.exit(main())
