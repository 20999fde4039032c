"""The control loop: simulated, recorded or real, it sees protocols only.

One control step:

    reference ----------------------------------+
                                                v
    plant.read -> picture -> estimator -> controller -> guard -> plant.write -> record
        ^                        ^                                    |
        |                        +------------- applied --------------+
        +------------------------------- robot <----------------------+

The robot is that of the plant: equations, a bench, or a record.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from tcrctl.controller.controller import Controller
from tcrctl.errors import StoppedError
from tcrctl.estimator.estimator import Estimator
from tcrctl.loop.pacing import Pace, Unpaced
from tcrctl.loop.safety import SafetyGuard
from tcrctl.picture.picture import Picture, Unjudged
from tcrctl.plant.plant import Plant
from tcrctl.signals import Command, Measurement, StepRecord, Timing
from tcrctl.trajectory.references import References
from tcrctl.trajectory.trajectory import Trajectory

#: How the reason of a step begins whose drives were held because the picture was in doubt.
HELD: Final = "held: "


def step_count(duration: float, period: float) -> int:
    """Return how many steps of ``period`` cover ``duration``, both [s]; at least 1."""
    return max(1, math.ceil(duration / period - 1e-9))


def still(measured: Measurement) -> Command:
    """Return the command that holds the drives where they were measured."""
    return Command(np.zeros_like(measured.drive), measured.drive.copy())


def _discard(step: StepRecord) -> None:
    """Discard a record."""


@dataclass(frozen=True, slots=True)
class Parts:
    """What goes round in a loop, how often, at which pace and within which limits.

    Attributes:
        trajectory: What is wanted.
        plant: Is measured and driven; whoever made it closes it.
        estimator: Finds the state from what is measured and what was applied.
        controller: Finds the command.
        period: Control period [s].
        steps: Control steps from beginning to end.
        pace: Lets every step begin when it is due.
        guard: Says when the run must stop; watches one run.
        record: Takes every step.
        picture: Judges what the cameras show; watches one run.
        references: What of the trajectory belongs to every step.
    """

    trajectory: Trajectory
    plant: Plant
    estimator: Estimator
    controller: Controller
    period: float
    steps: int
    pace: Pace = field(default_factory=Unpaced)
    guard: SafetyGuard = field(default_factory=SafetyGuard)
    record: Callable[[StepRecord], None] = _discard
    picture: Picture = field(default_factory=Unjudged)
    references: References = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "references", References(self.trajectory, self.period))


class Ticked(NamedTuple):
    """One step, and why it must be the last one; None if it need not."""

    step: StepRecord
    broken: StoppedError | None


def tick(parts: Parts, k: int, applied: Command | None) -> Ticked:
    """Do one control step. One that breaks a safety limit holds the drives, and so does a picture in doubt.

    Args:
        parts: The loop.
        k: Index of the step.
        applied: What was applied in the step before; None in the first one.

    Raises:
        DivergenceError: If a simulated plant diverged.
        RunInterruptedError: If a signal asked to stop.
        DeviceError: If the plant failed.
    """
    plant = parts.plant
    t = k * parts.period
    now = parts.pace.now
    late, t0 = parts.pace.wait(t), now()
    seen, truth = plant.read(), plant.truth()
    t1 = now()
    measured, doubt = parts.picture.judged(seen, parts.pace.elapsed()), parts.picture.doubt
    estimate = parts.estimator.update(measured, still(measured) if applied is None else applied)
    t2 = now()
    reference = parts.references.at(k, parts.controller.ahead)
    wanted, info = parts.controller.control(estimate, reference)
    t3 = now()
    broken = parts.picture.broken(k) or parts.guard.check(k, reference, estimate, wanted, info)
    sent = plant.write(still(measured) if broken or doubt else wanted)
    info = replace(info, reason=HELD + doubt) if doubt else info
    timing = Timing(t1 - t0, t2 - t1, t3 - t2, now() - t3, late)
    step = StepRecord(k, t, parts.period, reference, measured, estimate, wanted, sent, info, truth, timing)
    return Ticked(step, broken)


def run_loop(parts: Parts) -> None:
    """Run a loop from beginning to end.

    A step that breaks a safety limit is recorded like any other; then the run stops.

    Raises:
        StoppedError: If a limit was broken, or the plant diverged.
        RunInterruptedError: If a signal asked to stop.
        DeviceError: If the plant failed.
        LogError: If a step could not be recorded.
    """
    applied = None
    for k in range(parts.steps):
        step, broken = tick(parts, k, applied)
        parts.record(step)
        if broken:
            raise broken
        applied = step.applied
