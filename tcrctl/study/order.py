"""One run of a study, in a worker process: whatever happens, it becomes a row."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, TypeAlias

from tcrctl.errors import InfeasibleError, NoEquilibriumError, StoppedError, TcrctlError, TimeLimitError
from tcrctl.experiment.prepare import Experiment, plan, prepare
from tcrctl.experiment.random_path import random_path
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import LoadedSpec
from tcrctl.experiment.summary import Summary
from tcrctl.experiment.unrecorded import run_unrecorded
from tcrctl.study.address import program
from tcrctl.study.row import SIGNALS, TIMING, Row, same_every_time
from tcrctl.study.self_calibration import SelfCalibration

Logs: TypeAlias = Literal["all", "failed", "none"]


@dataclass(frozen=True, slots=True)
class Order:
    """What a worker needs to know.

    Attributes:
        address: Of the run.
        loaded: The experiment.
        seed: Of the run.
        random_path: Whether the seed draws its trajectory.
        timeout_s: A run that takes longer is stopped [s].
        logs: Which logs are kept.
        out: Where, a folder.
        calibration: What the run begins with; None if it knows nothing of its plant.
        found: Folder of what was found.
    """

    address: str
    loaded: LoadedSpec
    seed: int
    random_path: bool
    timeout_s: float | None
    logs: Logs
    out: Path
    calibration: SelfCalibration | None
    found: Path


def do(order: Order) -> Row | None:
    """Do a run; return None if a signal stopped it.

    Args:
        order: What to do.
    """
    begin = time.monotonic()
    try:
        row = _done(order, _limit(order.timeout_s, begin))
    except (InfeasibleError, NoEquilibriumError) as error:
        row = Row(order.address, "infeasible", str(error))
    except TimeLimitError as error:
        row = Row(order.address, "timeout", str(error))
    except StoppedError as error:  # before the run began
        row = Row(order.address, "aborted", str(error))
    except TcrctlError as error:
        row = Row(order.address, "error", str(error))
    except Exception as error:
        row = Row(order.address, "error", f"internal error: {type(error).__name__}: {error}")
    return row and replace(row, seconds=time.monotonic() - begin, program=program())


def _limit(timeout_s: float | None, begin: float) -> Callable[[], None]:
    def check() -> None:
        if timeout_s is not None and time.monotonic() - begin > timeout_s:
            raise TimeLimitError(timeout_s)

    return check


def _done(order: Order, check: Callable[[], None]) -> Row | None:
    path: dict[str, Any] = {}
    loaded = _known(order, check)
    if loaded is None:
        return None
    if order.random_path:
        experiment, refused = random_path(loaded, order.seed)
        path = {"refused": refused, "trajectory": experiment.spec.trajectory.model_dump(mode="json")}
    else:
        experiment = prepare(loaded, seed=order.seed)
        _check_feasible(experiment)
    check()
    summary = _run(order, experiment, check)
    if summary.exit_code >= SIGNALS:
        return None
    made = summary.as_json()
    if summary.reason == str(TimeLimitError(order.timeout_s or 0.0)):
        return Row(order.address, "timeout", summary.reason, log=made["log"])
    return Row(
        address=order.address,
        status=made["status"],
        reason=summary.reason,
        result=same_every_time(made),
        timing={key: made[key] for key in TIMING if key in made},
        log=made["log"],
        path=path,
    )


def _known(order: Order, check: Callable[[], None]) -> LoadedSpec | None:
    """Return the experiment with what it knows of its plant; None if a signal came before that was found."""
    if order.calibration is None:
        return order.loaded
    return order.calibration.known_by(order.loaded, order.seed, order.found, check)


def _run(order: Order, experiment: Experiment, check: Callable[[], None]) -> Summary:
    if order.logs == "none":
        return run_unrecorded(experiment, check)
    summary = run_experiment(experiment, out=order.out, check=check)
    if order.logs == "failed" and summary.exit_code == 0 and summary.log is not None:
        shutil.rmtree(summary.log.parent, ignore_errors=True)
        return replace(summary, log=None)
    return summary


def _check_feasible(experiment: Experiment) -> None:
    """Refuse what ``tcrctl run`` refuses; asked once for all seeds of a cell that share a path."""
    spec = experiment.spec
    drawn = str(spec.seed) if spec.task is not None else ""
    parts = (spec.trajectory, spec.controller, spec.task, experiment.loaded.robot)
    key = "\n".join([*("" if part is None else part.model_dump_json() for part in parts), drawn])
    refused = _refusal(_Asked(key, experiment))
    if refused is not None:
        raise refused


@dataclass(frozen=True, slots=True)
class _Asked:
    """An experiment that equals every other one with the same key."""

    key: str
    experiment: Experiment

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Asked) and other.key == self.key


@lru_cache(maxsize=64)
def _refusal(asked: _Asked) -> TcrctlError | None:
    try:
        plan(asked.experiment)
    except TcrctlError as error:
        return error
    return None
