"""Cost of one step of the simulated tcr700 while its drives follow a moving reference.

    python benchmarks/plant_step.py [--seconds 5] [--step-ms 1] [--friction 0.1]

The drives swing by 20 mm, out of phase, once in 5 s; without and with friction in the cable holes, and as the whole
simulated plant with everything that ``plant.realistic: moderate`` draws. Also compared: the structured solve of one
Newton step (factor K, couple the cables, solve) with a dense solve by numpy of the same matrix.
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

from tcrctl.numerics import block_banded
from tcrctl.plant.realistic import as_drawn
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot import dynamics, linear
from tcrctl.robot.description import load_robot
from tcrctl.robot.equations import FORCE, Load, assemble, make_workspace
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import Robot, build_robot, hole_friction
from tcrctl.robot.sections import FrictionSettings
from tcrctl.robot.unworn import unworn
from tcrctl.signals import Array, Command

RHO = 0.8
PERIOD, REACH = 5.0, 0.02


def speeds(t: float, m: int) -> Array:
    """Drive speeds [m/s] of the moving reference, eased in over the first second."""
    ease = min(t, 1.0) ** 2 * (3.0 - 2.0 * min(t, 1.0))
    rate = 2.0 * np.pi / PERIOD
    return ease * REACH * rate * np.cos(rate * t + np.arange(m) * np.pi / 3.0)


def run(robot: Robot, seconds: float, h: float, friction: float | None = None) -> tuple[Array, Array]:
    """Return the wall time of every step [us] and its Newton iterations."""
    model, m, slip = robot.model, robot.n_cables, None
    if friction is not None:
        holes = hole_friction(FrictionSettings(coefficient=friction), model.first_hole)
        slip = unworn(model, robot.rest.q, np.zeros(m), robot.rest.tension, holes)
    state = dynamics.rest_state(robot.rest.q, np.zeros(m), slip)
    work, scratch = make_workspace(model, rubbing=slip is not None), dynamics.make_scratch(model)
    times, iterations, rule = [], [], dynamics.Rule(h, RHO)
    dynamics.advance(model, state, np.zeros(m), h, rule, robot.weight, work, scratch)  # compile
    for k in range(round(seconds / h)):
        speed = speeds(k * h, m)
        begin = time.perf_counter()
        done = dynamics.advance(model, state, speed, h, rule, robot.weight, work, scratch)
        times.append(1e6 * (time.perf_counter() - begin))
        iterations.append(done[3])
        if not done[0]:
            raise SystemExit(f"step {k} did not converge")
    return np.array(times), np.array(iterations)


def realistic(robot: Robot, seconds: float, h: float) -> float:
    """Return the wall time of a step [us] of a plant that is all of *moderate*, its periods of 50 ms as a whole."""
    ideal = SimulatedSettings(kind="simulated", step_ms=1e3 * h, realistic="moderate", scatter=None)
    plant = SimulatedPlant(as_drawn(ideal, robot.n_cables, 1), robot, 0.05, 1)
    times = []
    for k in range(round(seconds / 0.05)):
        command = Command(speeds(0.05 * k, robot.n_cables), np.zeros(robot.n_cables))
        begin = time.perf_counter()
        plant.write(command)
        times.append(1e6 * (time.perf_counter() - begin) * h / 0.05)
    return float(np.median(times))


def solves(robot: Robot, step: float, repeats: int = 300) -> tuple[float, float, float]:
    """Return the median time [us] of the structured and of the dense solve, and the largest relative difference."""
    model, m = robot.model, robot.n_cables
    nodal = np.zeros((4, robot.rest.q.size))
    nodal[FORCE] = robot.weight
    load = Load(4.0 / step**2, 2.0 / step, nodal, np.zeros(len(model.bars)), np.zeros(m), None)
    ws = make_workspace(model)
    assemble(model, robot.rest.q, np.zeros(m), load, ws, np.bool_(True))
    G = ws.G[:, 3 * FIXED :]
    dense = block_banded.to_dense(ws.K) + G.T @ (ws.axial[:, None] * G)
    b, x = np.random.default_rng(0).standard_normal(ws.r.size), np.empty(ws.r.size)
    times = []
    for _ in range(repeats + 1):  # the first compiles
        begin = time.perf_counter()
        linear.factor_shifted(ws.K, ws.U)
        linear.solve(ws, b, x)
        middle = time.perf_counter()
        y = np.linalg.solve(dense, b)
        times.append((middle - begin, time.perf_counter() - middle))
    structured, plain = np.median(times[1:], axis=0)
    return 1e6 * structured, 1e6 * plain, float(np.abs(x - y).max() / np.abs(y).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--step-ms", type=float, default=1.0)
    parser.add_argument("--friction", type=float, default=0.1)
    given = parser.parse_args()
    step = given.step_ms / 1000.0
    robot = build_robot(load_robot("tcr700"))
    times, iterations = run(robot, given.seconds, step)
    structured, dense, difference = solves(robot, step)
    table = Table(title=f"tcr700, step {given.step_ms:g} ms, {times.size} steps, drives moving")
    table.add_column("quantity")
    table.add_column("value", justify="right")
    table.add_column("unit")
    for name, part in (("p50", 0.5), ("p99", 0.99), ("max", 1.0)):
        table.add_row(f"step {name}", f"{np.quantile(times, part):.1f}", "us")
    table.add_row("simulated time / wall time", f"{1e6 * step * times.size / times.sum():.1f}", "1")
    table.add_row("Newton iterations, mean", f"{iterations.mean():.2f}", "1")
    table.add_row("Newton iterations, max", f"{iterations.max():d}", "1")
    rubbing, rubbing_iterations = run(robot, given.seconds, step, given.friction)
    table.add_row(f"step p50 with friction {given.friction:g}", f"{np.median(rubbing):.1f}", "us")
    table.add_row("with / without friction", f"{np.median(rubbing) / np.median(times):.2f}", "1")
    table.add_row("Newton iterations with friction, mean", f"{rubbing_iterations.mean():.2f}", "1")
    table.add_row("step p50, realistic: moderate", f"{realistic(robot, given.seconds, step):.1f}", "us")
    table.add_row("structured solve", f"{structured:.1f}", "us")
    table.add_row("dense solve (numpy)", f"{dense:.1f}", "us")
    table.add_row("dense / structured", f"{dense / structured:.1f}", "1")
    table.add_row("largest relative difference", f"{difference:.1e}", "1")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    table.add_row("peak memory", f"{peak:.0f}", "MiB")
    Console().print(table)


if __name__ == "__main__":
    main()
