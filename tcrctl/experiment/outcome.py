"""How a run ended, held against its criteria."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from tcrctl.errors import RunInterruptedError, StoppedError, TcrctlError
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.prepare import Experiment
from tcrctl.experiment.summary import Summary, Verdict, judge


def summary_of(
    experiment: Experiment,
    run_id: str,
    metrics: Metrics,
    task: dict[str, Any],
    failure: TcrctlError | None,
    log: Path | None = None,
) -> Summary:
    """Return the result of a run.

    Args:
        experiment: What was run.
        run_id: Name of the run.
        metrics: What was measured.
        task: Result of the task; empty if there is none.
        failure: What ended it early, if something did.
        log: The log, if there is one.
    """
    spec = experiment.spec
    summary = Summary(
        run_id=run_id,
        spec=spec.name,
        robot=experiment.robot.name,
        plant=spec.plant.kind,
        controller=spec.controller.kind,
        seed=spec.seed,
        overrides=experiment.loaded.overrides,
        status="success",
        reason="",
        exit_code=0,
        measures=metrics.measures(),
        criteria=(),
        log=log,
        task=task,
    )
    verdicts = judge(spec.criteria, summary.as_json())
    if failure is not None:  # nobody knows what would have come
        verdicts = tuple(replace(verdict, passed=False) for verdict in verdicts)
    status, reason, exit_code = _outcome(failure, verdicts)
    return replace(summary, criteria=verdicts, status=status, reason=reason, exit_code=exit_code)


def _outcome(failure: TcrctlError | None, verdicts: tuple[Verdict, ...]) -> tuple[str, str, int]:
    """Return the status, reason and exit code of a run."""
    if failure is not None:
        aborted = isinstance(failure, StoppedError | RunInterruptedError)
        return "aborted" if aborted else "error", str(failure), failure.exit_code
    missed = [str(verdict) for verdict in verdicts if not verdict.passed]
    return ("failed", "; ".join(missed), 3) if missed else ("success", "", 0)
