"""Rig files that name cameras or drives from elsewhere: their settings become members of the unions of the file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache, partialmethod
from pathlib import Path
from typing import Annotated, Any, Final, Union

from pydantic import Field, create_model

from tcrctl.config.keys import Keys
from tcrctl.config.settings import Settings
from tcrctl.config.strict_yaml import Document
from tcrctl.config.unions import kind_of, models_in
from tcrctl.errors import InputError, SpecError, with_hint
from tcrctl.plant.rig.settings import CameraSection, DriveSection, MountedRobot, RigFile
from tcrctl.plugins.groups import registered
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.plugin import made_again, plugin_of, settings_of
from tcrctl.plugins.trust import Trust
from tcrctl.robot.sections import Name

#: What settings from elsewhere derive from.
BASES: Final[dict[str, type[Settings]]] = {"cameras": CameraSection, "plc": DriveSection}
#: The model in which a section stands.
_OWNERS: Final[dict[str, type[Settings]]] = {"cameras": RigFile, "plc": MountedRobot}


def built_in(section: str) -> dict[str, type[Settings]]:
    """Return the settings of the built-in kinds of a section by name."""
    members: Iterator[Any] = (m for m, _ in models_in(_OWNERS[section].model_fields[section].annotation))
    return {kind_of(member): member for member in members}


def with_devices(document: Document, trust: Trust) -> type[RigFile]:
    """Return the model of a rig file that also knows the kinds from elsewhere that it names.

    Args:
        document: The rig file.
        trust: Where files are that it names.

    Raises:
        SpecError: If kinds cannot be loaded; all are named with their places.
    """
    found: dict[str, list[type[Settings]]] = {"cameras": [], "plc": []}
    problems = []
    for section, keys, kind in _foreign(document.data):
        try:
            settings = settings_of(section, kind, BASES[section], trust.file)
        except InputError as error:
            problems.append(document.problem((*keys, "kind"), with_hint(error)))
            continue
        if settings is not None and settings not in found[section]:
            found[section].append(settings)
    if problems:
        raise SpecError(problems)
    return joined(tuple(found["cameras"]), tuple(found["plc"]))


@cache
def joined(cameras: tuple[type[Settings], ...], drives: tuple[type[Settings], ...]) -> type[RigFile]:
    """Return the model of a rig file with more kinds of cameras and drives; the same one every time."""
    if not cameras and not drives:
        return RigFile
    kinds = tuple(_origin(settings) for settings in (*cameras, *drives))
    mounted = _more(MountedRobot, {"plc": drives}, kinds) if drives else MountedRobot
    robots: Any = (dict[Name, mounted], RigFile.model_fields["robots"])  # type: ignore[valid-type]
    return _more(RigFile, {"cameras": cameras}, kinds, robots=robots)


def _more(
    model: type[Any], added: dict[str, Sequence[type[Settings]]], kinds: tuple[Origin, ...], **fields: Any
) -> type[Any]:
    for section, settings in added.items():
        if settings:
            members = (*built_in(section).values(), *settings)
            union: Any = Union[members]  # noqa: UP007  # made of a tuple
            fields[section] = (Annotated[union, Field(discriminator="kind")], ...)
    made = create_model(model.__name__, __base__=model, __doc__=model.__doc__, **fields)
    made.__reduce__ = partialmethod(_reduced, kinds)  # type: ignore[assignment]
    return made


def _reduced(settings: Settings, kinds: tuple[Origin, ...]) -> tuple[Any, ...]:
    """Send a rig file to another process: its class is made, so nobody finds it by its name."""
    return _blank, (type(settings).__name__, kinds), settings.__getstate__()


def _blank(name: str, kinds: tuple[Origin, ...]) -> Settings:
    found: dict[str, list[type[Settings]]] = {"cameras": [], "plc": []}
    for origin in kinds:
        found[origin.section].append(made_again(origin))
    rig = joined(tuple(found["cameras"]), tuple(found["plc"]))
    robots: Any = [model for model, _ in models_in(rig.model_fields["robots"].annotation)]
    made = rig if name == rig.__name__ else robots[0]
    return made.__new__(made)  # type: ignore[no-any-return]


def with_registered() -> type[RigFile]:
    """Return the model of a rig file that also knows every kind that installed packages have registered.

    Those that cannot be loaded are left out.
    """
    found: dict[str, list[type[Settings]]] = {"cameras": [], "plc": []}
    for section, base in BASES.items():
        names = dict.fromkeys(point.name for point in registered(section))
        for kind in (name for name in names if name not in built_in(section)):
            with suppress(InputError):
                settings = settings_of(section, kind, base, Path)
                found[section] += [] if settings is None else [settings]
    return joined(tuple(found["cameras"]), tuple(found["plc"]))


def device_origins(rig: RigFile, robot: str) -> tuple[Origin, ...]:
    """Return where cameras and drives of a robot come from that are not built in."""
    found = (plugin_of(settings) for settings in (rig.cameras, rig.robots[robot].plc))
    return tuple(plugin.origin for plugin in found if plugin is not None)


def _origin(settings: type[Settings]) -> Origin:
    plugin: Any = settings.plugin
    origin: Origin = plugin.origin
    return origin


def _foreign(data: Any) -> Iterator[tuple[str, Keys, str]]:
    """Yield section, place and kind of all devices that are not built in."""
    robots = data.get("robots") if isinstance(data, dict) else None
    places: list[Keys] = [("cameras",)]
    places += [("robots", name, "plc") for name in robots] if isinstance(robots, dict) else []
    for keys in places:
        kind = _kind_at(data, keys)
        section = str(keys[-1])
        if isinstance(kind, str) and kind not in built_in(section):
            yield section, keys, kind


def _kind_at(data: Any, keys: Keys) -> Any:
    for key in (*keys, "kind"):
        data = data.get(key) if isinstance(data, dict) else None
    return data
