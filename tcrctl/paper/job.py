"""What has to be run for a row of the table: an experiment or a check; each in a process of its own."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

#: Folder of the runs below that of the report.
RUNS: Final = "runs"


class Job(Protocol):
    """Something to be run; equal jobs are one."""

    @property
    def label(self) -> str:
        """Name for messages."""
        ...

    @property
    def alone(self) -> bool:
        """Whether nothing else may run at the same time, since the time it takes is measured."""
        ...

    def command(self, folder: Path) -> list[str]:
        """Return arguments of the process; it prints one JSON object and exits with a code of :mod:`tcrctl.errors`.

        Args:
            folder: Where it may write.
        """
        ...


@dataclass(frozen=True, slots=True)
class Run:
    """A shipped experiment.

    Attributes:
        experiment: Its name.
        overrides: Values set in it, as for ``--set``.
        alone: As in :class:`Job`.
    """

    experiment: str
    overrides: tuple[str, ...] = ()
    alone: bool = False

    @property
    def label(self) -> str:
        """What a person would type."""
        return " ".join((self.experiment, *(f"--set {text}" for text in self.overrides)))

    def command(self, folder: Path) -> list[str]:
        """Return the arguments of ``tcrctl run``."""
        sets = [part for text in self.overrides for part in ("--set", text)]
        program = [sys.executable, "-m", "tcrctl.cli.app", "run", self.experiment]
        return [*program, "--json", "--quiet", "--out", str(folder / RUNS), *sets]


@dataclass(frozen=True, slots=True)
class Check:
    """A measurement of :mod:`tcrctl.paper.checks`.

    Attributes:
        name: Its name there.
        alone: As in :class:`Job`.
    """

    name: str
    alone: bool = False

    @property
    def label(self) -> str:
        """Name for messages."""
        return self.name.replace("_", " ")

    def command(self, folder: Path) -> list[str]:
        """Return the arguments of the check."""
        del folder
        return [sys.executable, "-m", "tcrctl.paper.checks", self.name]
