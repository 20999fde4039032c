"""A run in simulation that leaves nothing but its result: what studies do thousands of times."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

from tcrctl.errors import TcrctlError
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.outcome import summary_of
from tcrctl.experiment.prepare import Experiment, build_parts, build_plant, make_task
from tcrctl.experiment.run import Check, no_check
from tcrctl.experiment.summary import Summary
from tcrctl.loop.loop import run_loop
from tcrctl.loop.pacing import Unpaced
from tcrctl.signals import StepRecord


def run_unrecorded(experiment: Experiment, check: Check = no_check) -> Summary:
    """Run an experiment without a log; the numbers are those of a recorded run, bit for bit.

    Args:
        experiment: With a simulated plant.
        check: Called before every step; what it raises ends the run.
    """
    metrics, task = Metrics(experiment.steps, paced=False), make_task(experiment)
    failure: TcrctlError | None = None

    def record(step: StepRecord) -> None:
        metrics.add(step)
        if task is not None:
            task.observe(step)

    try:
        plant, state = build_plant(experiment)
        with closing(plant):
            parts, _ = build_parts(experiment, plant, state)
            metrics = Metrics(parts.steps, paced=False)
            plant.start()
            run_loop(replace(parts, record=record, pace=Unpaced(check)))
    except TcrctlError as error:
        failure = error
    return summary_of(experiment, "", metrics, {} if task is None else task.result(), failure)
