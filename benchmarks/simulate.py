"""One experiment in simulation, without a log: what the benchmarks of robustness run many times."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.setdefault("NUMBA_OPT", "1")

from tcrctl.errors import TcrctlError
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.prepare import Experiment, build_parts, build_plant, prepare
from tcrctl.experiment.spec import LoadedSpec, load_spec
from tcrctl.experiment.summary import Measures
from tcrctl.loop.loop import run_loop


@dataclass(frozen=True)
class Outcome:
    """What a run gave.

    Attributes:
        measures: Everything measured up to its end.
        failure: Why it ended early; empty if it did not.
    """

    measures: Measures
    failure: str

    def part(self, quantity: str, name: str = "max") -> float:
        """Return one number of a quantity, NaN if the run did not give it."""
        values = getattr(self.measures, quantity)
        return float("nan") if values is None else float(values[name])


def simulate(name: str, overrides: Sequence[str]) -> Outcome:
    """Run an experiment with some settings changed."""
    return simulate_loaded(load_spec(name, overrides))


def simulate_loaded(loaded: LoadedSpec) -> Outcome:
    """Run a loaded experiment."""
    try:
        experiment = prepare(loaded)
    except TcrctlError as error:
        return Outcome(Metrics(0, paced=False).measures(), str(error))
    return run(experiment)


def run(experiment: Experiment) -> Outcome:
    """Run a prepared experiment."""
    metrics, failure = Metrics(experiment.steps, paced=False), ""
    try:
        parts, _ = build_parts(experiment, *build_plant(experiment))
        run_loop(replace(parts, record=metrics.add))
    except TcrctlError as error:
        failure = str(error)
    return Outcome(metrics.measures(), failure)
