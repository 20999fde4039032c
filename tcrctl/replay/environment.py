"""What has changed since a log was recorded, of all that its bits depend on."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass

from tcrctl.experiment.provenance import versions
from tcrctl.log.file_names import PLUGINS
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles
from tcrctl.plugins.origin import Origin


@dataclass(frozen=True, slots=True)
class Change:
    """One thing that is not as it was.

    Attributes:
        name: Package, ``cpu``, ``source_sha256``, ...
        recorded: As it was; empty if the log does not say.
        now: As it is; empty if it is not there any more.
    """

    name: str
    recorded: str
    now: str

    def __str__(self) -> str:
        return f"{self.name} was {self.recorded or 'not recorded'}, is {self.now or 'not there'}"


def changes(log: Log) -> tuple[Change, ...]:
    """Compare the versions attached to a log with those of this process, by name."""
    was, now = RunFiles(log).versions(), versions()
    return tuple(
        Change(name, str(was.get(name, "")), now.get(name, ""))
        for name in dict.fromkeys((*was, *now))
        if str(was.get(name, "")) != now.get(name, "")
    )


def plugin_changes(log: Log, now: Iterable[Origin]) -> tuple[Change, ...]:
    """Compare the code of kinds from elsewhere with what was recorded, by digest.

    Args:
        log: The log.
        now: Where they come from in this process.
    """
    was = _recorded(RunFiles(log).content(PLUGINS))
    found = ((origin, was.get((origin.section, origin.kind), "")) for origin in now)
    return tuple(
        Change(f"{origin.section}.kind {origin.kind}", digest[:12], origin.sha256[:12])
        for origin, digest in found
        if digest != origin.sha256
    )


def _recorded(table: bytes) -> dict[tuple[str, str], str]:
    """Return the recorded digests by section and kind; empty if there are none that can be read."""
    try:
        rows = json.loads(table)
        return {(row["section"], row["kind"]): str(row["sha256"]) for row in rows}
    except (ValueError, RecursionError, TypeError, KeyError):
        return {}
