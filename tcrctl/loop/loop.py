"""The control loop: simulated, recorded or real, it sees protocols only.

    reference ------------------------+
                                      v
    plant.read -> estimator -> controller -> guard -> plant.write -> record
        ^             ^                                    |
        |             +------------- applied --------------+
        +------------------------- robot <-----------------+
"""  # fmt: skip

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tcrctl.controller.controller import Controller
from tcrctl.estimator.estimator import Estimator
from tcrctl.loop.pacing import Pace
from tcrctl.loop.safety import SafetyGuard, SafetyLimits
from tcrctl.plant.plant import Plant
from tcrctl.signals import Array, Command, Measurement, StepRecord, Timing
from tcrctl.trajectory.trajectory import Trajectory, sample_reference


def step_count(duration: float, period: float) -> int:
    """Return how many steps of ``period`` cover ``duration``, both [s]; at least 1."""
    return max(1, math.ceil(duration / period - 1e-9))


def still(measured: Measurement) -> Command:
    """Return the command that holds the drives where they were measured."""
    return Command(np.zeros_like(measured.drive), measured.drive.copy())


def in_periods(ahead: Array, period: float) -> Array:
    """Return prediction instants ``ahead`` (n,) [s] in periods, so that ``(k + ahead) * period`` is their time.

    An instant that several steps look at then has the same bits in all of them, and so has its reference: in the
    log all but one are a repetition, which the compressor removes.
    """
    return np.asarray(np.round(ahead / period, 9))


def run_loop(
    trajectory: Trajectory,
    estimator: Estimator,
    controller: Controller,
    plant: Plant,
    record: Callable[[StepRecord], None],
    *,
    period: float,
    duration: float,
    pace: Pace,
    limits: SafetyLimits,
) -> None:
    """Run a trajectory from beginning to end.

    A step that breaks a safety limit holds the drives and is recorded like any other; then the run stops.

    Args:
        trajectory: What is wanted.
        estimator: Finds the state from what is measured and what was applied.
        controller: Finds the command.
        plant: Is measured and driven; the caller closes it.
        record: Takes every step.
        period: Control period [s].
        duration: How long [s].
        pace: Lets every step begin when it is due.
        limits: What must be kept.

    Raises:
        StoppedError: If a limit was broken, or the plant diverged.
        RunInterruptedError: If a signal asked to stop.
        DeviceError: If the plant failed.
        LogError: If a step could not be recorded.
    """
    guard, applied, now = SafetyGuard(limits), None, pace.now
    ahead = in_periods(controller.ahead, period)
    for k in range(step_count(duration, period)):
        late, t0 = pace.wait(k * period), now()
        measured, truth = plant.read(), plant.truth()
        t1 = now()
        estimate = estimator.update(measured, still(measured) if applied is None else applied)
        t2 = now()
        reference = sample_reference(trajectory, k * period, (k + ahead) * period)
        wanted, info = controller.control(estimate, reference)
        t3 = now()
        broken = guard.check(k, reference, estimate, wanted, info)
        applied = plant.write(still(measured) if broken else wanted)
        timing = Timing(t1 - t0, t2 - t1, t3 - t2, now() - t3, late)
        record(
            StepRecord(
                k, k * period, period, reference, measured, estimate, wanted, applied, info, truth, timing
            )
        )
        if broken:
            raise broken
