"""Linearise the loop of an experiment at points along its simulated run.

    run without noise -> at some steps: copy of the loop -> inner map (42): largest |μ|
                                                         -> step map:       largest eigenvalues

A spectral radius below 1 at every point says that small deviations fade while the reference stays near that point;
it is a statement about slow trajectories ("frozen time"), exact where the robot is held at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.controller.controller import Controller
from tcrctl.controller.inner_map import InnerMap, Linearisable
from tcrctl.errors import InputError, StoppedError
from tcrctl.experiment.prepare import Experiment, build_parts, build_plant
from tcrctl.loop.interruption import Interruption
from tcrctl.loop.loop import Parts, run_loop
from tcrctl.loop.pacing import Unpaced
from tcrctl.numerics.spectrum import derivative, largest_eigenvalues
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Array, StepRecord
from tcrctl.stability.closed_loop import ClosedLoop, StepMap
from tcrctl.stability.report import StabilityPoint, StabilityReport

#: Length of a deviation of the loop's state, in the scales of its parts: some tens of micrometres per coordinate.
#: At standstill the solvers of plant and estimator accept what they have until it is off by their tolerance; with
#: smaller or one-sided differences such a jump would pass for a slope.
DEVIATION: Final = 1.0
#: The same for the inner iteration: nanometres, as rods bent by more change the robot's soft directions.
INNER_DEVIATION: Final = 1e-4
#: Eigenvalues kept per point.
COUNT: Final = 4
#: The map is applied to a random deviation this often before the search begins, so that stiff parts have died out.
SMOOTHING: Final = 3
#: So many random deviations are tried: now and then rounding makes the search from one of them find nothing.
STARTS: Final = 3

Progress = Callable[[int, int], None]


def _at_once(experiment: Experiment) -> Experiment:
    """Return an experiment whose controller does not settle first: a loop that waits feeds nothing back."""
    spec = experiment.spec
    controller = spec.controller.at_once()
    return replace(experiment, spec=spec.model_copy(update={"controller": controller}))


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
    experiment = _at_once(experiment)
    plant, state = build_plant(experiment)
    if not isinstance(plant, SimulatedPlant):
        plant.close()
        raise InputError("the stability analysis needs plant.kind: simulated; a robot cannot be copied")
    if not plant.smooth:
        raise InputError(
            "the stability analysis needs a plant that can be linearised",
            hint="Leave out plant.friction, drives, springs_hysteresis, cameras, realistic, the cables' creep, "
            "and step_ms: auto.",
        )
    plant.without_noise()
    parts, _ = build_parts(experiment, plant, state)
    linearisable(parts.controller).sharpen()
    parts.estimator.sharpen()
    stopped = ""
    with Interruption() as interruption:
        parts = replace(parts, pace=Unpaced(interruption.check))
        probe = _Probe(parts, analysed_steps(experiment.steps, points, every), progress)
        try:
            run_loop(replace(parts, record=probe.record))
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

    def __init__(self, parts: Parts, wanted: Sequence[int], progress: Progress) -> None:
        self._parts = parts
        self._wanted = frozenset(wanted)
        self._progress = progress
        self.points: list[StabilityPoint] = []
        self.states, self.what = 0, ""

    def record(self, step: StepRecord) -> None:
        """Take the record of a step; the parts now stand before the next one."""
        if step.k + 1 in self._wanted:
            self.points.append(self._point(ClosedLoop(self._parts, step.k + 1, step.applied)))
        self._progress(step.k + 1, self._parts.steps)

    def _point(self, loop: ClosedLoop) -> StabilityPoint:
        step, t = StepMap(loop), loop.k * self._parts.period
        self.states = step.size
        unknown = np.full(COUNT, np.nan, dtype=np.complex128)
        try:
            after = step.after(np.zeros(step.size))
            found, converged = spectrum_of(step)
        except StoppedError:
            return StabilityPoint(t, np.nan, unknown, False, False, False)
        inner = linearisable(after.loop.parts.controller).inner_map()
        self.what = self.what if inner is None else inner.what
        unknown[: found.size] = found
        info = after.info
        return StabilityPoint(
            t, inner_radius(inner), unknown, converged, bool(info.saturated.any()), info.lcp_pivots > 0
        )


def linearisable(controller: Controller) -> Linearisable:
    """Return the controller as what a linearisation needs.

    Raises:
        InputError: If it does not offer that.
    """
    if not isinstance(controller, Linearisable):
        raise InputError("a controller of this kind cannot be linearised")
    return controller


def spectrum_of(step: StepMap) -> tuple[NDArray[np.complex128], bool]:
    """Return the largest eigenvalues (at most COUNT) of a step map, and whether all were found.

    Raises:
        StoppedError: If the plant's integrator did not converge, or a command is no number.
    """
    product = derivative(step, step.size, DEVIATION, central=True)
    for seed in range(STARTS):
        start = np.random.default_rng(seed).standard_normal(step.size)
        for _ in range(SMOOTHING if step.size > COUNT else 0):
            start = product(start / np.linalg.norm(start))
        found = largest_eigenvalues(product, start, COUNT)
        if found.eigenvalues.size:
            break
    return found.eigenvalues, found.converged


def inner_radius(inner: InnerMap | None) -> float:
    """Return max |μ| of (42) at the point where the iteration ended; NaN if there is none."""
    if inner is None:
        return np.nan

    def scaled(x: Array) -> Array:
        return inner.apply(inner.point + inner.scale * x) / inner.scale

    size = inner.point.size
    product = derivative(scaled, size, INNER_DEVIATION, central=True)
    start = product(product(np.random.default_rng(0).standard_normal(size)))
    return largest_eigenvalues(product, start, 1).radius if start.any() else 0.0
