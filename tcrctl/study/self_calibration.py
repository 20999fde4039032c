"""A self-calibration before a run: the excitation on the plant of its seed, and what is found in that log.

experiment's robot and plant -> excitation, open loop -> log -> self-calibration -> ``estimator.calibration``

What was found is kept in the study's folder under an address of its own, so that all runs on one plant share it.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import tcrctl.identify
from tcrctl.config import strict_yaml
from tcrctl.errors import InputError, SpecError, StoppedError, with_hint
from tcrctl.estimator.calibration_settings import CalibrationSettings
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.run_folder import replace_file
from tcrctl.experiment.spec import LoadedSpec, load_spec
from tcrctl.study.address import address
from tcrctl.study.design import Cell
from tcrctl.study.loading import LoadedStudy
from tcrctl.study.row import FINISHED, SIGNALS

#: Folder of what was found, in that of the study.
FOLDER: Final = "calibrations"


@dataclass(frozen=True, slots=True)
class SelfCalibration:
    """What the runs of a cell begin with.

    Attributes:
        excitation: Its experiment, with robot and plant of those runs.
    """

    excitation: LoadedSpec

    def address(self, seed: int) -> str:
        """Return the address of what is found on the plant of a seed, 64 hexadecimal digits."""
        parts = (address(self.excitation, seed), identification())
        return hashlib.sha256("".join(parts).encode()).hexdigest()

    def known_by(
        self, loaded: LoadedSpec, seed: int, folder: Path, check: Callable[[], None]
    ) -> LoadedSpec | None:
        """Return an experiment that knows what is found on the plant of a seed; None if a signal came.

        Args:
            loaded: The experiment.
            seed: Of the plant.
            folder: Where what was found is kept.
            check: Raises when the time is over.

        Raises:
            StoppedError: If the excitation was stopped, or nothing was found in its log.
            TimeLimitError: From ``check``.
        DeviceError: If what was found cannot be kept.
        """
        path = folder / f"{self.address(seed)}.yaml"
        found = _kept(path) or self._find(seed, path, check)
        if found is None:
            return None
        estimator = loaded.spec.estimator.model_copy(update={"calibration": found})
        return replace(loaded, spec=loaded.spec.model_copy(update={"estimator": estimator}))

    def _find(self, seed: int, path: Path, check: Callable[[], None]) -> CalibrationSettings | None:
        with tempfile.TemporaryDirectory() as scratch:
            summary = run_experiment(prepare(self.excitation, seed=seed), out=Path(scratch), check=check)
            if summary.exit_code >= SIGNALS:
                return None
            check()
            if summary.log is None or summary.status not in FINISHED:
                raise StoppedError(f"no self-calibration: the excitation was stopped: {summary.reason}")
            found = _found_in(summary.log, f"{self.excitation.spec.name}, seed {seed}")
        _keep(path, found)
        return found


def self_calibration_of(study: LoadedStudy, cell: Cell, loaded: LoadedSpec) -> SelfCalibration | None:
    """Return what the runs of a cell begin with; None if they know nothing.

    Args:
        study: The study.
        cell: The cell.
        loaded: Its experiment.

    Raises:
        SpecError: If it has an estimator that knows no calibration, or one already; or if there is no such
            excitation, or it is none.
    """
    wanted = study.spec.calibrate
    if wanted is None or (wanted.cases and cell.case not in wanted.cases):
        return None
    estimator, name = loaded.spec.estimator, loaded.spec.name
    if not isinstance(estimator, PassiveObserverSettings):
        study.document.refuse([(("calibrate",), f"the estimator of {name} knows no calibration")])
    elif estimator.calibration != "off":
        study.document.refuse([(("calibrate",), f"{name} has an estimator.calibration already")])
    given = _excitation(study, wanted.excitation)
    spec = given.spec.model_copy(update={"robot": loaded.spec.robot, "plant": loaded.spec.plant})
    excitation = replace(
        given,
        spec=spec,
        robot=loaded.robot,
        robot_path=loaded.robot_path,
        plant_robot=loaded.plant_robot,
    )
    return SelfCalibration(excitation)


def _excitation(study: LoadedStudy, name: str) -> LoadedSpec:
    where = ("calibrate", "excitation")
    try:
        given = load_spec(study.beside(name))
    except SpecError:
        raise
    except InputError as error:
        study.document.refuse([(where, with_hint(error))])
        raise
    if given.spec.controller.kind != "open_loop":
        told = f"{name} is no excitation: its controller is {given.spec.controller.kind}, not open_loop"
        study.document.refuse([(where, told)])
    return given


@cache
def identification() -> str:
    """Return the digest of the sources that find robots: they stand beside what :func:`program` counts."""
    digest = hashlib.sha256()
    root = Path(tcrctl.identify.__path__[0])
    for source in sorted(root.rglob("*.py")):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()


def _found_in(log: Path, source: str) -> CalibrationSettings:
    from tcrctl.identify.calibration.files import calibration_of  # scipy's sparse algebra
    from tcrctl.identify.calibration.self_calibration import calibrate
    from tcrctl.identify.calibration.settings import SelfCalibrationSpec

    try:
        found = calibrate(log, SelfCalibrationSpec(friction=False))  # runs find out by themselves what rubs
    except InputError as error:
        raise StoppedError(f"no self-calibration: {error}") from error
    if not found.result.fit.converged:
        raise StoppedError("no self-calibration: the fit did not converge")
    return calibration_of(found.result, found.body.description.modules.count, source)


def _kept(path: Path) -> CalibrationSettings | None:
    """Read what was found before; None if it is not there, or not whole."""
    with suppress(InputError):
        return strict_yaml.validate(strict_yaml.load(path), CalibrationSettings)
    return None


def _keep(path: Path, found: CalibrationSettings) -> None:
    """Write what was found.

    Raises:
        DeviceError: If it cannot be written.
    """
    replace_file(path, strict_yaml.dumps(found.model_dump(mode="json", exclude_none=True)))
