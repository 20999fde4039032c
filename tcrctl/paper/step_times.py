"""How long control and plant steps take, as multiples of a fixed workload that is measured in between.

Milliseconds are those of one machine at one moment: two processes that share a core double them. What a step takes
in CPU time over what a piece of linear algebra takes right beside it tells the program, not the machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from tcrctl.experiment.prepare import build_parts, build_plant, prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.loop.loop import Parts, tick
from tcrctl.loop.pacing import Unpaced
from tcrctl.signals import Array, Command

#: The experiment whose steps are measured: two segments, pose, on the plant as it is shipped.
EXPERIMENT: Final = "cone_frustum"
#: Control steps that are measured, after some in which caches fill.
STEPS: Final = 400
FIRST: Final = 20
#: Internal step of its plant [s].
INTERNAL_S: Final = 1e-3
#: The workload: so many Cholesky factorisations of a matrix as large as the robot's tangent.
FACTORISATIONS: Final = 4
SIZE: Final = 156


class CpuTime(Unpaced):
    """Steps as fast as they go, timed by what the processor has spent on this thread."""

    def now(self) -> float:
        """Return the CPU time of this thread [s]."""
        return time.thread_time()


def workload() -> Callable[[], float]:
    """Return what does the workload and tells its CPU time [s]."""
    matrix = np.ones((SIZE, SIZE)) + SIZE * np.eye(SIZE)

    def work() -> float:
        begin = time.thread_time()
        for _ in range(FACTORISATIONS):
            np.linalg.cholesky(matrix)
        return time.thread_time() - begin

    return work


def step_times(name: str = EXPERIMENT, steps: int = STEPS) -> dict[str, Any]:
    """Return the CPU times of the steps of an experiment.

    Args:
        name: Experiment with a simulated plant.
        steps: Control steps that are measured.

    Returns:
        ``control`` (estimator, reference and controller; p50, p99) and ``plant`` (an internal step; p50, p99) as
        multiples of the workload's median; the same in ``control_ms``, ``plant_ms``; ``workload_ms``.
    """
    experiment = prepare(load_spec(name))
    plant, state = build_plant(experiment)
    parts, _ = build_parts(experiment, plant, state)
    inner = round(experiment.period / INTERNAL_S)
    control, internal, reference = _measured(replace(parts, pace=CpuTime()), FIRST + steps, inner)
    plant.close()
    unit = float(np.median(reference))
    parts_of = {"control": control, "plant": internal}
    return {
        **{part: _quantiles(times / unit) for part, times in parts_of.items()},
        **{f"{part}_ms": _quantiles(1e3 * times) for part, times in parts_of.items()},
        "workload_ms": 1e3 * unit,
        "steps": steps,
    }


def _measured(parts: Parts, steps: int, inner: int) -> tuple[Array, Array, Array]:
    """Return times of control steps, of internal steps and of the workload between them (steps - FIRST,) [s]."""
    work, times = workload(), []
    applied: Command | None = None
    for k in range(steps):
        step, broken = tick(parts, k, applied)
        if broken is not None:
            raise broken
        applied, took = step.applied, step.timing
        times.append((took.estimate + took.control, took.write / inner, work()))
    control, internal, reference = np.array(times[FIRST:]).T
    return control, internal, reference


def _quantiles(times: Array) -> dict[str, float]:
    p50, p99 = np.quantile(times, (0.5, 0.99))
    return {"p50": float(p50), "p99": float(p99)}
