"""Study files, and the experiments of their cells."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Keys
from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError, Problem, SpecError, with_hint
from tcrctl.experiment.spec import LoadedSpec, load_spec
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.study.design import Cell
from tcrctl.study.settings import CASE, StudySpec

#: Keys whose values may be paths.
_FILES = ("robot", "plant.robot")


@dataclass(frozen=True, slots=True)
class LoadedStudy:
    """A study ready to run, and where it came from.

    Attributes:
        spec: The study.
        document: What was read, for the places of its values.
        folder: Where relative paths of experiments start.
    """

    spec: StudySpec
    document: Document
    folder: Path

    def load(self, cell: Cell) -> LoadedSpec:
        """Read the experiment of a cell, with its settings.

        Raises:
            SpecError: If it has problems; those of settings of the study stand at their places in it.
            InputError: If there is no such experiment, or it is of the wrong kind.
        """
        name = cell.experiment
        changes = cell.changes(self.spec)
        given = [
            f"{key}={json.dumps(self._beside(key, v), ensure_ascii=False)}" for key, v in changes.items()
        ]
        try:
            loaded = load_spec(self.experiment_path(name), given)
        except SpecError as error:
            raise SpecError([self._placed(problem, cell) for problem in error.problems]) from None
        if not isinstance(loaded.spec.plant, SimulatedSettings):
            self._refuse(name, f"{loaded.spec.name} runs on a {loaded.spec.plant.kind}; studies simulate")
        if self.spec.paths == "random" and loaded.spec.controller.tracks != "pose":
            self._refuse(name, f"{loaded.spec.name} has no orientation; paths: random needs one")
        return loaded

    def experiment_path(self, name: str) -> str:
        """Return name or path as other parts of the program take it.

        Raises:
            SpecError: If it is a study.
        """
        path = self.beside(name)
        if shipped.is_study(path):
            self._refuse(name, f"{name} is a study; a study is made of experiments")
        return path

    def beside(self, name: str) -> str:
        """Return the path of a file beside the study; a name, or a path that is none, as it is."""
        path = self.folder / Path(name).expanduser()
        return str(path) if shipped.is_path(name) and path.is_file() else name

    def _beside(self, key: str, value: Any) -> Any:
        """Look for a robot's file beside the study; leave everything else as it is given."""
        if key in _FILES and isinstance(value, str) and shipped.is_path(value):
            path = self.folder / Path(value).expanduser()
            return str(path.absolute()) if path.is_file() else value
        return value

    def _refuse(self, experiment: str, message: str) -> None:
        index = self.spec.experiments.index(experiment)
        self.document.refuse([(("experiments", index), message)])

    def _placed(self, problem: Problem, cell: Cell) -> Problem:
        """Put a problem of a setting at the place where the study gives it."""
        key = problem.where.removeprefix("--set ")
        if key == problem.where:
            return problem
        for where, keys in self._sources(cell):
            if key in keys:
                named = f"{problem.key}: " if problem.key and problem.key != key else ""
                return self.document.problem((*where, key), f"{named}{problem.message}")
        return problem

    def _sources(self, cell: Cell) -> Iterator[tuple[Keys, Sequence[str]]]:
        yield ("vary",), list(self.spec.vary)
        if cell.case is not None:
            yield ("cases", cell.case), list(self.spec.cases[cell.case])
        yield ("set",), list(self.spec.set)


def load_study(name_or_path: str) -> LoadedStudy:
    """Read a study file.

    Args:
        name_or_path: Shipped name, or path of a YAML file.

    Raises:
        UnknownNameError: If there is no shipped study of that name.
        SpecError: If the file has problems; all are listed.
        InputError: If the file is missing.
    """
    path = shipped.find_study(name_or_path)
    document = strict_yaml.load(path)
    return checked(LoadedStudy(strict_yaml.validate(document, StudySpec), document, path.parent))


def checked(study: LoadedStudy) -> LoadedStudy:
    """Return a study whose experiments are experiments, with different names.

    Raises:
        SpecError: If they are not.
        InputError: If there is no such experiment.
    """
    seen: dict[str, str] = {}
    for i, given in enumerate(study.spec.experiments):
        try:
            name = load_spec(study.experiment_path(given)).spec.name
        except InputError as error:
            if isinstance(error, SpecError):
                raise
            study.document.refuse([(("experiments", i), with_hint(error))])
            raise
        if name in seen:
            study.document.refuse([(("experiments", i), f"is {name}, as {seen[name]} is")])
        seen[name] = given
    return study


def narrowed(
    study: LoadedStudy, *, experiments: Sequence[str] = (), cases: Sequence[str] = (), **changes: object
) -> LoadedStudy:
    """Return a study with some of its experiments and cases, and with other values at the top level.

    Args:
        study: The whole one.
        experiments: Names that stay; all if empty.
        cases: Cases that stay; all if empty.
        **changes: Values of the study's keys, not None.

    Raises:
        InputError: If a name is none of the study's.
        SpecError: If the values do not go together.
    """
    data = {**study.document.data, **{key: value for key, value in changes.items() if value is not None}}
    for what, names, known in (
        ("experiment", experiments, study.spec.experiments),
        (CASE, cases, tuple(study.spec.cases)),
    ):
        for name in names:
            if name not in known:
                raise InputError(f"the study has no {what} {name}; it has {', '.join(known) or 'none'}")
    if experiments:
        data["experiments"] = [name for name in study.spec.experiments if name in experiments]
    if cases:
        data["cases"] = {name: study.document.data["cases"][name] for name in cases}
        if study.spec.compare is not None and study.spec.compare.against not in cases:
            data.pop("compare")
    document = replace(study.document, data=data)
    return LoadedStudy(strict_yaml.validate(document, StudySpec), document, study.folder)
