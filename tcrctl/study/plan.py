"""Which runs a study is made of, each with its address."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tcrctl.errors import SpecError
from tcrctl.experiment.spec import LoadedSpec
from tcrctl.study.address import address
from tcrctl.study.design import Cell, cells
from tcrctl.study.loading import LoadedStudy
from tcrctl.study.self_calibration import self_calibration_of
from tcrctl.study.settings import StudySpec

#: Cells with problems that are told at once.
MOST_TOLD = 20


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A run of a study, before it is done.

    Attributes:
        address: What it is found by.
        levels: Factor by factor what it has, as text.
        seed: Its seed.
        cell: Where it belongs.
    """

    address: str
    levels: dict[str, str]
    seed: int
    cell: Cell


def planned(study: LoadedStudy) -> list[PlannedRun]:
    """Return all runs of a study in order.

    Raises:
        SpecError: If the settings of some cells do not go together; they are listed.
    """
    runs: list[PlannedRun] = []
    problems: dict[object, None] = {}
    for cell in cells(study.spec):
        try:
            runs += _of_cell(study, cell)
        except SpecError as error:
            problems |= dict.fromkeys(error.problems)
            if len(problems) >= MOST_TOLD:
                break
    if problems:
        raise SpecError(list(problems))  # type: ignore[arg-type]  # they are problems
    return runs


def _of_cell(study: LoadedStudy, cell: Cell) -> Iterator[PlannedRun]:
    loaded, random_path = study.load(cell), study.spec.paths == "random"
    levels, calibration = cell.levels(loaded.spec.name), self_calibration_of(study, cell, loaded)
    for seed in seeds_of(study.spec, loaded):
        known = None if calibration is None else calibration.address(seed)
        found_by = address(loaded, seed, random_path=random_path, calibration=known)
        yield PlannedRun(found_by, levels, seed, cell)


def seeds_of(spec: StudySpec, loaded: LoadedSpec) -> Sequence[int]:
    """Return the seeds of a cell: those of the study, or the experiment's own."""
    return (loaded.spec.seed,) if spec.seeds is None else spec.seeds
