"""Experiments that name kinds from elsewhere: their settings become members of the unions of the experiment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import partial, partialmethod
from pathlib import Path
from typing import Any, Final, TypeVar, Union

from pydantic import create_model

from tcrctl.config import strict_yaml
from tcrctl.config.settings import Settings
from tcrctl.config.strict_yaml import Document
from tcrctl.config.unions import kind_of, models_in
from tcrctl.controller.settings import OwnControllerSection
from tcrctl.errors import InputError, Problem, TcrctlError, with_hint
from tcrctl.estimator.section import EstimatorSection
from tcrctl.log.file_names import PLUGINS, RESOLVED
from tcrctl.plant.settings import PlantSection
from tcrctl.plugins.faults import told
from tcrctl.plugins.groups import GROUPS, registered
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.plugin import is_written_out, made_again, plugin_of, settings_of
from tcrctl.plugins.trust import Trust
from tcrctl.task.section import TaskSection
from tcrctl.trajectory.section import TrajectorySection

Model = TypeVar("Model", bound=Settings)

_CONSENT: Final = "Give the folder that holds it, once you have read it: --plugins FOLDER"
#: What settings from elsewhere derive from.
BASES: Final[Mapping[str, type[Settings]]] = {
    "trajectory": TrajectorySection,
    "controller": OwnControllerSection,
    "estimator": EstimatorSection,
    "plant": PlantSection,
    "task": TaskSection,
}


def trust_of(path: Path) -> Trust:
    """Return whose code may run for an experiment of the user: all that it names.

    Args:
        path: Its file; in the folder of its run lie the files of its kinds.
    """
    return Trust(path.parent, by_name=path.name == RESOLVED and (path.parent / PLUGINS).is_file())


def with_plugins(document: Document, model: type[Model], trust: Trust) -> tuple[type[Model], list[Problem]]:
    """Return the model of an experiment that also knows the kinds from elsewhere that it names.

    Args:
        document: The experiment.
        model: Of an experiment with built-in kinds.
        trust: Whose code may run.

    Returns:
        The model, and why kinds cannot be loaded, at their places in the document.
    """
    fields: dict[str, Any] = {}
    problems: list[Problem] = []
    for section, kind in _foreign(document.data, model):
        try:
            if is_written_out(kind) and not (trust.files or _is_override(document, section)):
                raise InputError(
                    f"{kind} names code, and code is not run because a log says so", hint=_CONSENT
                )
            find = partial(_file, document, section, trust)
            found = settings_of(section, kind, BASES[section], find)
        except InputError as error:
            problems.append(document.problem((section, "kind"), with_hint(error)))
            continue
        if found is not None:
            fields[section] = found
    return _with(model, fields), problems


def _with(model: type[Model], found: Mapping[str, type[Settings]]) -> type[Model]:
    """Return the model with one more kind in some of its sections."""
    if not found:
        return model
    fields: dict[str, Any] = {
        section: _joined(model, section, settings) for section, settings in found.items()
    }
    made = create_model(model.__name__, __base__=model, __doc__=model.__doc__, **fields)
    made.__reduce__ = partialmethod(_reduced, model)  # type: ignore[assignment]
    return made


def _reduced(spec: Settings, model: type[Settings]) -> tuple[Any, ...]:
    """Send an experiment to another process: its class is made, so nobody finds it by its name."""
    return _blank, (model, origins(spec)), spec.__getstate__()


def _blank(model: type[Settings], kinds: Sequence[Origin]) -> Settings:
    made = _with(model, {origin.section: made_again(origin) for origin in kinds})
    return made.__new__(made)


def validated(document: Document, model: type[Model]) -> Model:
    """Return the experiment that a document describes.

    Raises:
        SpecError: If it has problems.
        InputError: If a validator from elsewhere raises what none may.
    """
    try:
        return strict_yaml.validate(document, model)
    except TcrctlError:
        raise
    except Exception as error:
        raise InputError(f"{document.name}: its settings could not be checked: {told(error, '')}") from error


def built_in(model: type[Settings], section: str) -> dict[str, type[Settings]]:
    """Return the settings of the kinds of a section by name, in the order of the union."""
    members: Iterator[Any] = (member for member, _ in models_in(model.model_fields[section].annotation))
    return {kind_of(member): member for member in members}


def with_registered(model: type[Model]) -> type[Model]:
    """Return the model of an experiment that also knows every kind that installed packages have registered.

    Those that cannot be loaded are left out.
    """
    for section in GROUPS:
        for kind in dict.fromkeys(point.name for point in registered(section)):
            if kind not in built_in(model, section):
                with suppress(InputError):
                    found = settings_of(section, kind, BASES[section], Path)
                    if found is not None:
                        joined: Any = {section: _joined(model, section, found)}
                        model = create_model(model.__name__, __base__=model, __doc__=model.__doc__, **joined)
    return model


def origins(spec: Settings) -> tuple[Origin, ...]:
    """Return where the kinds of an experiment come from that are not built in, in the order of its sections."""
    named = (getattr(spec, section) for section in GROUPS)
    found = (plugin_of(settings) for settings in named if settings is not None)  # most runs have no task
    return tuple(plugin.origin for plugin in found if plugin is not None)


def _foreign(data: Any, model: type[Settings]) -> Iterator[tuple[str, str]]:
    """Yield section and kind of all kinds that are not built in."""
    for section in GROUPS:
        given = data.get(section) if isinstance(data, dict) else None
        kind = given.get("kind") if isinstance(given, dict) else given
        if isinstance(kind, str) and kind not in built_in(model, section):
            yield section, kind


def _is_override(document: Document, section: str) -> bool:
    return any(document.is_override(keys) for keys in ((section,), (section, "kind")))


def _file(document: Document, section: str, trust: Trust, place: str) -> Path:
    """Return the file that a kind means: relative to the experiment, or to where the user is with ``--set``."""
    return Path(place).expanduser() if _is_override(document, section) else trust.file(place)


def _joined(model: type[Settings], section: str, found: type[Settings]) -> Any:
    """Return annotation and default of a section with one more member."""
    field = copy(model.model_fields[section])
    field.annotation = Union[field.annotation, found]  # type: ignore[assignment]  # noqa: UP007
    return (field.annotation, field)
