"""Linearise the loop of an experiment at points along its simulated run.

    run without noise -> at some steps: copy of the loop -> inner map (42): largest |μ|
                                                         -> step map:       largest eigenvalues

A spectral radius below 1 at every point says that small deviations fade while the reference stays near that point;
it is a statement about slow trajectories ("frozen time"), exact where the robot is held at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.controller.inner_map import InnerMap
from tcrctl.errors import DivergenceError, InputError, StoppedError
from tcrctl.experiment.prepare import Experiment, Parts, build_parts, build_plant
from tcrctl.loop.interruption import Interruption
from tcrctl.loop.loop import run_loop
from tcrctl.loop.pacing import Unpaced
from tcrctl.numerics.spectrum import derivative, largest_eigenvalues
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Array, StepRecord
from tcrctl.stability.closed_loop import ClosedLoop, StepMap
from tcrctl.stability.report import StabilityPoint, StabilityReport
from tcrctl.trajectory.trajectory import sample_reference

#: Length of a deviation of the loop's state, in the scales of its parts: some tens of micrometres per coordinate.
#: At standstill the solvers of plant and estimator accept what they have until it is off by their tolerance; with
#: smaller or one-sided differences such a jump would pass for a slope.
STEP: Final = 1.0
#: The same for the inner iteration: nanometres, as rods bent by more change the robot's soft directions.
INNER_STEP: Final = 1e-4
#: Eigenvalues kept per point.
COUNT: Final = 4
#: The map is applied to a random deviation this often before the search begins, so that stiff parts have died out.
SMOOTHING: Final = 3

Progress = Callable[[int, int], None]


def analysed_steps(steps: int, points: int, every: int | None = None) -> list[int]:
    """Return the steps at which the loop is linearised, the first step never among them.

    Args:
        steps: Steps of the run.
        points: How many points, spread evenly.
        every: Take every n-th step instead.
    """
    if every is not None:
        return list(range(every, steps, every))
    return sorted({int(k) for k in np.linspace(1, max(1, steps - 1), points).round() if 0 < k < steps})


def analyse(
    experiment: Experiment,
    *,
    points: int = 24,
    every: int | None = None,
    progress: Progress = lambda done, total: None,
) -> StabilityReport:
    """Run an experiment in simulation, without noise, and linearise its loop on the way.

    Args:
        experiment: What :func:`tcrctl.experiment.prepare.prepare` made.
        points: How many points, spread evenly over the run.
        every: Take every n-th control step instead.
        progress: Takes the number of steps done and their total, after every step.

    Returns:
        The report; also of a run that was stopped by a limit, up to there.

    Raises:
        InputError: If the plant is not simulated, or has friction, play or the like.
        RunInterruptedError: If a signal asked to stop.
    """
    plant, state = build_plant(experiment)
    if not isinstance(plant, SimulatedPlant):
        plant.close()
        raise InputError("the stability analysis needs plant.kind: simulated; a robot cannot be copied")
    if not plant.smooth:
        raise InputError(
            "the stability analysis needs a plant that can be linearised",
            hint="Leave out plant.friction, drives, springs_hysteresis, cameras, realistic and the cables' creep.",
        )
    plant.without_noise()
    parts = build_parts(experiment, plant, state)
    parts.controller.sharpen()
    probe = _Probe(experiment, parts, plant, points, every, progress)
    stopped = ""
    with Interruption() as interruption:
        pace = Unpaced(interruption.check)
        try:
            run_loop(
                parts.trajectory,
                parts.estimator,
                parts.controller,
                plant,
                probe.record,
                period=experiment.period,
                duration=parts.trajectory.duration,
                pace=pace,
                limits=experiment.safety,
            )
        except StoppedError as error:
            stopped = str(error)
    spec = experiment.spec
    return StabilityReport(
        spec.name,
        experiment.robot.name,
        spec.controller.kind,
        experiment.period,
        probe.states,
        probe.what,
        tuple(probe.points),
        stopped,
    )


class _Probe:
    """Takes the records of a run, and looks at the loop before the steps that were asked for."""

    def __init__(
        self,
        experiment: Experiment,
        parts: Parts,
        plant: SimulatedPlant,
        points: int,
        every: int | None,
        progress: Progress,
    ) -> None:
        self.parts, self._plant, self._progress = parts, plant, progress
        self._steps, self._period = experiment.steps, experiment.period
        self._wanted = set(analysed_steps(self._steps, points, every))
        self.points: list[StabilityPoint] = []
        self.states, self.what = 0, ""

    def record(self, step: StepRecord) -> None:
        """Take the record of a step; the parts now stand before the next one."""
        if step.k + 1 in self._wanted:
            loop = ClosedLoop(self._plant, self.parts.estimator, self.parts.controller, step.applied)
            self.points.append(self._point((step.k + 1) * self._period, loop))
        self._progress(step.k + 1, self._steps)

    def _point(self, t: float, loop: ClosedLoop) -> StabilityPoint:
        reference = sample_reference(self.parts.trajectory, t, t + loop.controller.ahead)
        step = StepMap(loop, reference)
        self.states = step.size
        unknown = np.full(COUNT, np.nan, dtype=np.complex128)
        try:
            after = step.after(np.zeros(step.size))
            found, converged = spectrum_of(step)
        except DivergenceError:
            return StabilityPoint(t, np.nan, unknown, False, False, False)
        inner = after.loop.controller.inner_map()
        self.what = self.what if inner is None else inner.what
        unknown[: found.size] = found
        info = after.info
        return StabilityPoint(
            t, inner_radius(inner), unknown, converged, bool(info.saturated.any()), info.lcp_pivots > 0
        )


def spectrum_of(step: StepMap) -> tuple[NDArray[np.complex128], bool]:
    """Return the largest eigenvalues (at most COUNT) of a step map, and whether all were found.

    Raises:
        DivergenceError: If the plant's integrator did not converge.
    """
    product = derivative(step, step.size, STEP, central=True)
    start = np.random.default_rng(0).standard_normal(step.size)
    for _ in range(SMOOTHING if step.size > COUNT else 0):
        start = product(start / np.linalg.norm(start))
    found = largest_eigenvalues(product, start, COUNT)
    return found.eigenvalues, found.converged


def inner_radius(inner: InnerMap | None) -> float:
    """Return max |μ| of (42) at the point where the iteration ended; NaN if there is none."""
    if inner is None:
        return np.nan

    def scaled(x: Array) -> Array:
        return inner.apply(inner.point + inner.scale * x) / inner.scale

    size = inner.point.size
    product = derivative(scaled, size, INNER_STEP, central=True)
    start = product(product(np.random.default_rng(0).standard_normal(size)))
    return largest_eigenvalues(product, start, 1).radius if start.any() else 0.0
