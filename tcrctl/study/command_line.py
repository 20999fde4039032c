"""A study that is told on the command line: an experiment and what varies in it, or changes of a study file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Keys
from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError, Problem, SpecError
from tcrctl.experiment.spec import load_spec
from tcrctl.study.loading import LoadedStudy, checked, load_study
from tcrctl.study.settings import StudySpec


def told_study(
    name_or_path: str, assignments: Sequence[str] = (), changes: Mapping[str, Any] | None = None
) -> LoadedStudy:
    """Return the study of a file, or make one of an experiment.

    Args:
        name_or_path: A study or an experiment, shipped or a file.
        assignments: ``key=a,b,c``: the key takes these values one by one; ``key=a``: all runs have it.
        changes: Other keys of the study that are given; None is not given.

    Raises:
        SpecError: If something does not go together.
        InputError: If there is no such study or experiment.
    """
    given = {key: value for key, value in (changes or {}).items() if value is not None}
    study = load_study(name_or_path) if shipped.is_study(name_or_path) else _of_experiment(name_or_path)
    if not (assignments or given):
        return study
    data, places = dict(study.document.data), dict[Keys, str]()
    for key, value in given.items():
        data[key] = value
        places[(key,)] = f"--{key.replace('_', '-')}"
    for assignment in assignments:
        _assign(data, places, assignment)
    document = replace(study.document, data=data, _overridden={**study.document._overridden, **places})
    return checked(LoadedStudy(strict_yaml.validate(document, StudySpec), document, study.folder))


def _of_experiment(name: str) -> LoadedStudy:
    loaded = load_spec(name)
    data = {"kind": "study", "name": loaded.spec.name, "experiments": [name]}
    document = strict_yaml.placed("command line", data, {})
    return LoadedStudy(strict_yaml.validate(document, StudySpec), document, Path())


def _assign(data: dict[str, Any], places: dict[Keys, str], assignment: str) -> None:
    key, values = _parsed(assignment)
    section = "vary" if len(values) > 1 else "set"
    for other in ("vary", "set"):
        data[other] = {k: v for k, v in (data.get(other) or {}).items() if k != key}
    data[section][key] = values if section == "vary" else values[0]
    places[(section, key)] = f"--set {key}"


def _parsed(assignment: str) -> tuple[str, list[Any]]:
    """Return key and values of an assignment; commas within brackets and quotes belong to a value."""
    key, equals, text = (part.strip() for part in assignment.partition("="))
    if not equals or not text or not all(key.split(".")):
        raise _refused(
            assignment, "must be key=value or key=value,value, for instance controller.period_s=0.05,0.1"
        )
    try:
        document: Document = strict_yaml.loads(f"[{text}]", f"--set {key}")
    except SpecError as error:
        raise _refused(key, error.problems[0].message) from None
    if document.broken:
        raise _refused(key, document.broken[0][1].message)
    if not isinstance(document.data, list) or not document.data:
        raise InputError(f"--set {key}: has no value")
    return key, document.data


def _refused(what: str, message: str) -> SpecError:
    return SpecError([Problem(f"--set {what}", "", message)])
