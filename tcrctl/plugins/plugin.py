"""A kind from elsewhere, found by what a file says.

``pid``              registered by an installed package
``my_package:PID``   a module that can be imported
``./pid.py:PID``     a file, relative to the experiment's

What is found is a line as in the tables of built-in kinds: ``(Settings, build)``. Its settings get the key
``kind`` with the one value under which they were found, so that they are checked, shown and listed like others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, Literal, cast

from pydantic import create_model

from tcrctl.config.settings import Settings
from tcrctl.errors import InputError
from tcrctl.plugins.groups import package_of, registered
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.source import from_file, from_module

Find = Callable[[str], Path]
Line = tuple[type[Settings], Callable[..., Any]]


@dataclass(frozen=True, slots=True)
class Plugin:
    """A kind from elsewhere.

    Attributes:
        build: Its builder.
        origin: Where it comes from.
    """

    build: Callable[..., Any]
    origin: Origin


def plugin_of(settings: Settings) -> Plugin | None:
    """Return what a section's kind comes from; None for a built-in one."""
    return cast("Plugin | None", settings.plugin)


def is_written_out(kind: str) -> bool:
    """Tell whether a kind names its code itself, ``module:Name`` or ``file.py:Name``."""
    return ":" in kind


def settings_of(section: str, kind: str, base: type[Settings], find: Find) -> type[Settings] | None:
    """Return the settings of a kind from elsewhere; None if no package has registered the name.

    Args:
        section: Section of the experiment.
        kind: Its kind, not a built-in one.
        base: What the settings of its kinds derive from.
        find: Returns the file that a path in the experiment means, or raises an InputError.

    Raises:
        InputError: If the kind cannot be loaded, or is no line of a table of kinds.
    """
    if is_written_out(kind):
        place, _, name = kind.rpartition(":")
        is_file = place.endswith(".py") or "/" in place or "\\" in place
        line, origin = (
            from_file(section, kind, find(place), name)
            if is_file
            else from_module(section, kind, place, name)
        )
    else:
        point = _registered(section, kind)
        if point is None:
            return None
        line, origin = from_module(section, kind, point.module, point.attr)
    settings, build = _checked(origin, line, base)
    return _with_kind(settings, build, origin)


def _registered(section: str, kind: str) -> EntryPoint | None:
    points = [point for point in registered(section) if point.name == kind]
    if len(points) > 1:
        packages = " and ".join(package_of(point) for point in points)
        values = " or ".join(point.value for point in points)
        raise InputError(f"{section}.kind: {kind} is registered twice, by {packages}", hint=f"Write {values}")
    return points[0] if points else None


def _checked(origin: Origin, line: Any, base: type[Settings]) -> Line:
    """Return settings class and builder, if a line has them."""
    if not isinstance(line, tuple) or len(line) != 2:
        raise InputError(f"{origin.what}: must be a pair (Settings, build), not a {type(line).__name__}")
    settings, build = line
    if not (isinstance(settings, type) and issubclass(settings, base)):
        named = getattr(settings, "__name__", repr(settings))
        raise InputError(f"{origin.what}: its settings, {named}, must derive from {base.__name__}")
    if not callable(build):
        raise InputError(f"{origin.what}: its builder, {build!r}, cannot be called")
    return settings, build


@cache
def _with_kind(settings: type[Settings], build: Callable[..., Any], origin: Origin) -> type[Settings]:
    """Return the same class every time, or two equal experiments would differ."""
    kind: Any = (Literal[origin.kind], ...)
    made = create_model(settings.__name__, __base__=settings, __doc__=settings.__doc__, kind=kind)
    made.plugin = Plugin(build, origin)
    return made
