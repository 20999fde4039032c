"""What has to be run for a row of the table: an experiment or a check; each in a worker process."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, Protocol

from tcrctl.errors import TcrctlError
from tcrctl.experiment.prepare import plan, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.paper.checks import CHECKS

#: Folder of the runs below that of the report.
RUNS: Final = "runs"
#: An experiment whose kernels most others need.
_TYPICAL: Final = "cone_frustum"


class Job(Protocol):
    """Something to be run; equal jobs are one."""

    @property
    def label(self) -> str:
        """Name for messages."""
        ...

    @property
    def alone(self) -> bool:
        """Whether nothing else may run at the same time, since the time it takes is measured."""
        ...

    def run(self, folder: Path) -> tuple[Mapping[str, Any], int]:
        """Do it; returns an object of numbers and an exit code of :mod:`tcrctl.errors`.

        Args:
            folder: Where it may write.

        Raises:
            TcrctlError: If there is nothing to be measured.
        """
        ...


@dataclass(frozen=True, slots=True)
class Done:
    """What became of a job.

    Attributes:
        job: The job.
        result: What it found; empty if nothing.
        reason: Why there is nothing to be measured; empty if there is.
        seconds: Wall time [s].
        code: Exit code, as in :mod:`tcrctl.errors`.
    """

    job: Job
    result: Mapping[str, Any]
    reason: str
    seconds: float
    code: int = 0


def do(order: tuple[Job, Path]) -> Done:
    """Do a job in this process.

    Args:
        order: The job, and the folder where it may write.
    """
    job, folder = order
    begin = time.monotonic()
    try:
        result, code = job.run(folder)
    except TcrctlError as error:
        result = {}
        code = error.exit_code
        reason = str(error)
    else:  # a missed criterion is no failure
        reason = "" if code in (0, 3) and result else str(result.get("reason") or f"exit code {code}")
    return Done(job, result, reason, time.monotonic() - begin, code)


def warm_up() -> None:
    """Compile on all cores what most jobs need, before they begin side by side."""
    prepare(load_spec(_TYPICAL), ahead=True)


@dataclass(frozen=True, slots=True)
class Run:
    """A shipped experiment.

    Attributes:
        experiment: Its name.
        overrides: Values set in it, as for ``--set``.
        alone: As in :class:`Job`: the times of runs do not count.
    """

    experiment: str
    overrides: tuple[str, ...] = ()
    alone: ClassVar[bool] = False

    @property
    def label(self) -> str:
        """What a person would type."""
        return " ".join((self.experiment, *(f"--set {text}" for text in self.overrides)))

    def run(self, folder: Path) -> tuple[Mapping[str, Any], int]:
        """Do what ``tcrctl run --json`` does."""
        experiment = prepare(load_spec(self.experiment, self.overrides))
        plan(experiment)
        summary = run_experiment(experiment, out=folder / RUNS)
        return summary.as_json(), summary.exit_code


@dataclass(frozen=True, slots=True)
class Check:
    """A measurement of :mod:`tcrctl.paper.checks`.

    Attributes:
        name: Its name there.
        alone: As in :class:`Job`.
    """

    name: str
    alone: bool = False

    @property
    def label(self) -> str:
        """Name for messages."""
        return self.name.replace("_", " ")

    def run(self, folder: Path) -> tuple[Mapping[str, Any], int]:
        """Measure."""
        del folder
        return CHECKS[self.name](), 0
