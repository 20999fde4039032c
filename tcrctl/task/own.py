"""A task from elsewhere: what it says is checked in every step, and at the end."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

from tcrctl.errors import InputError, PluginStoppedError
from tcrctl.log.event import Event
from tcrctl.plugins.faults import built, called, refuse_lacking
from tcrctl.plugins.handed import handed
from tcrctl.plugins.plugin import Plugin, plugin_of
from tcrctl.signals import StepRecord
from tcrctl.task.section import TaskSection
from tcrctl.trajectory.pose_path import EndPose


class OwnTask:
    """Calls ``observe(step)`` and ``result()`` of what ``build(settings, targets, rod_diameter)`` returned.

    The result is asked for after every step: one that cannot be had is a safe stop, not a run without an end.
    """

    def __init__(
        self, settings: TaskSection, plugin: Plugin, targets: Mapping[str, EndPose], rod_diameter: float
    ) -> None:
        """Build it.

        Raises:
            InputError: If the builder raises, or what it returns is no task.
        """
        self._origin = plugin.origin
        self._made = built(plugin.origin, plugin.build, settings, targets, rod_diameter)
        refuse_lacking(plugin.origin, self._made, ("observe", "result"))
        self._result: dict[str, Any] = {}

    def observe(self, step: StepRecord) -> Sequence[Event]:
        """Take a step; return what happened in it.

        Raises:
            PluginStoppedError: If it raises, or returns something else.
        """
        found = called(self._origin, "observe", self._made.observe, handed(step))
        events = [] if found is None else found
        if not isinstance(events, list | tuple) or not all(isinstance(event, Event) for event in events):
            raise self._refused("observe", f"a {type(found).__name__}, not a list of Events")
        self._result = self._checked(called(self._origin, "result", self._made.result))
        return events

    def result(self) -> dict[str, Any]:
        """Return the object ``task`` of ``run --json``, as it was after the last step."""
        return self._result

    def _checked(self, found: Any) -> dict[str, Any]:
        if not isinstance(found, dict):
            raise self._refused("result", f"a {type(found).__name__}, not a dict")
        try:
            checked: dict[str, Any] = json.loads(json.dumps(found, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise self._refused("result", f"what is no JSON: {error}") from None
        return checked

    def _refused(self, name: str, what: str) -> PluginStoppedError:
        return PluginStoppedError(self._origin.what, f"{name} returned {what}")


def targets_of(settings: TaskSection) -> Mapping[str, EndPose]:
    """Return the named poses of a section from elsewhere.

    Raises:
        InputError: If it raises, or returns something else.
    """
    plugin = plugin_of(settings)
    assert plugin is not None
    found: Any = built(plugin.origin, settings.targets)
    if not all(isinstance(pose, EndPose) for pose in getattr(found, "values", lambda: [None])()):
        raise InputError(f"{plugin.origin.what}: targets must be a dict of EndPose by name")
    return cast("Mapping[str, EndPose]", found)
