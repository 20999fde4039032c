"""A study is run: what its store has not yet, side by side, each run once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from tcrctl.config import strict_yaml
from tcrctl.errors import DeviceError, RunInterruptedError
from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import Crash, outcomes
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run_folder import check_writable
from tcrctl.experiment.spec import LoadedSpec
from tcrctl.loop.interruption import Interruption
from tcrctl.study.address import program
from tcrctl.study.design import Cell
from tcrctl.study.loading import LoadedStudy
from tcrctl.study.order import Logs, Order, do
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import WITHOUT_RESULT, Row, unanswered
from tcrctl.study.self_calibration import FOLDER, SelfCalibration, self_calibration_of
from tcrctl.study.store import Store

#: The study as it was run, in its folder; and where logs go there.
STUDY: Final = "study.yaml"
RUNS: Final = "runs"
#: A process is ended if a run is late by this factor of its time limit, and by this time [s]: it hangs.
PATIENCE, PATIENCE_S = 1.5, 30.0


Told = Callable[[PlannedRun, Row], None]


@dataclass(frozen=True, slots=True)
class Done:
    """A study as far as it got.

    Attributes:
        runs: Every run that it is made of, in order.
        rows: Row of each; None where there is none yet.
        new: How many runs were done now.
        seconds: Wall time [s].
        repaired: Lines of the store that were not whole.
        interruption: What ended it early, if something did.
    """

    runs: tuple[PlannedRun, ...]
    rows: tuple[Row | None, ...]
    new: int
    seconds: float
    repaired: int
    interruption: RunInterruptedError | DeviceError | None

    @property
    def missing(self) -> int:
        """Runs that are not done."""
        return sum(row is None for row in self.rows)

    @property
    def unanswered(self) -> str:
        """Say how many of the runs that are done have no result; nothing if all have one."""
        return unanswered([row for row in self.rows if row is not None])

    @property
    def exit_code(self) -> int:
        """Of :mod:`tcrctl.errors`: a missed criterion or a limit is a result, a run without a result is 3."""
        if self.interruption is not None:
            return self.interruption.exit_code
        return WITHOUT_RESULT if self.unanswered else 0


def folder_of(study: LoadedStudy, out: Path) -> Path:
    """Return the folder of a study: the same one every time, so that it is found again."""
    return out / f"{study.spec.name}.study"


def sweep(
    study: LoadedStudy,
    runs: Sequence[PlannedRun],
    *,
    engine: Engine,
    out: Path,
    logs: Logs = "failed",
    retry: bool = False,
    told: Told = lambda run, row: None,
) -> Done:
    """Do what is missing of a study.

    Args:
        study: The study.
        runs: What it is made of, from :func:`tcrctl.study.plan.planned`.
        engine: Where.
        out: Where the folder of the study is, or is made.
        logs: Which logs are kept, of runs that are done now.
        retry: Do those again that have no result.
        told: Is told of every run when it is done.

    Raises:
        DeviceError: If the folder cannot be used.
    """
    check_writable(out)
    folder = folder_of(study, out)
    begin = time.monotonic()
    new = 0
    interruption: RunInterruptedError | DeviceError | None = None
    with Store(folder) as store:
        (folder / STUDY).write_text(strict_yaml.dumps(study.spec.model_dump(mode="json")), encoding="utf-8")
        if retry:
            store.forget(run.address for run in runs)
        try:
            for run, row in _rows(study, _missing(runs, store), engine, folder, logs):
                store.add(row)
                new += 1
                told(run, row)
        except (RunInterruptedError, DeviceError) as error:
            interruption = error
        rows = tuple(store.get(run.address) for run in runs)
        return Done(tuple(runs), rows, new, time.monotonic() - begin, store.repaired, interruption)


def _missing(runs: Sequence[PlannedRun], store: Store) -> list[PlannedRun]:
    """Return the runs that the store has not, each address once."""
    return list({run.address: run for run in runs if run.address not in store}.values())


def _rows(
    study: LoadedStudy, missing: Sequence[PlannedRun], engine: Engine, folder: Path, logs: Logs
) -> Iterator[tuple[PlannedRun, Row]]:
    """Yield the row of every run as it is done."""
    if not missing:
        return
    timeout, by_address = study.spec.timeout_s, {run.address: run for run in missing}
    deadline = None if timeout is None else PATIENCE * timeout + PATIENCE_S
    first = study.load(missing[0].cell)
    with Interruption() as interruption:
        for order, row in outcomes(
            engine,
            do,
            _orders(study, missing, folder, logs),
            check=interruption.check,
            deadline_s=deadline,
            warm=partial(prepare, first, ahead=True),
        ):
            if isinstance(row, Crash):
                row = Row(order.address, "crashed", row.reason, program=program())
            if row is None:  # a signal that came to the worker alone
                continue
            if row.program != program():
                raise DeviceError(
                    "a worker runs another version of the program, whose numbers may differ",
                    hint="Install the same version everywhere; NUMBA_OPT must be the same too.",
                )
            yield by_address[order.address], row


def _orders(study: LoadedStudy, missing: Sequence[PlannedRun], folder: Path, logs: Logs) -> Iterator[Order]:
    """Yield orders in the order of the plan; the experiment of a cell is read once for all its seeds."""
    cell: Cell | None = None
    loaded: LoadedSpec | None = None
    calibration: SelfCalibration | None = None
    for run in missing:
        if loaded is None or run.cell is not cell:
            cell, loaded = run.cell, study.load(run.cell)
            calibration = self_calibration_of(study, cell, loaded)
        yield Order(
            run.address,
            loaded,
            run.seed,
            study.spec.paths == "random",
            study.spec.timeout_s,
            logs,
            (folder / RUNS).absolute(),
            calibration,
            (folder / FOLDER).absolute(),
        )
