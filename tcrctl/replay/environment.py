"""What has changed since a log was recorded, of all that its bits depend on."""

from __future__ import annotations

from dataclasses import dataclass

from tcrctl.experiment.provenance import versions
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles


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
