"""Jobs for the comparison with the paper that are no experiments; worker processes can be given them."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, field

from tcrctl.errors import InputError, RunInterruptedError
from tcrctl.loop.interruption import Interruption


@dataclass(frozen=True)
class Result:
    """A job that has its result already, or an error."""

    label: str
    values: tuple = ()
    code: int = 0
    error: str = ""
    alone: bool = False

    def run(self, folder):
        del folder
        if self.error:
            raise InputError(self.error)
        return dict(self.values), self.code


@dataclass(frozen=True)
class Killed:
    """A job that ends its process."""

    label: str
    alone: bool = False

    def run(self, folder):
        del folder
        os.kill(os.getpid(), signal.SIGKILL)


@dataclass(frozen=True)
class Marked:
    """Leaves a mark while it runs; waits for a partner's, or looks whether there is none."""

    label: str
    partner: str = ""
    alone: bool = field(default=False)

    def run(self, folder):
        mark, begin = folder / self.label, time.monotonic()
        mark.touch()
        while self.partner and not (folder / self.partner).exists() and time.monotonic() - begin < 30.0:
            time.sleep(0.01)
        time.sleep(0.2)
        seen = sorted(path.name for path in folder.iterdir())
        if not self.partner:
            mark.unlink()
        return {"x": seen}, 0


@dataclass(frozen=True)
class Patient:
    """Does nothing until it is asked to stop, and then says that it could."""

    label: str
    alone: bool = False

    def run(self, folder):
        with Interruption() as interruption:
            try:
                while True:
                    interruption.check()
                    (folder / "running").touch()
                    time.sleep(0.05)
            except RunInterruptedError as error:
                (folder / "safe").touch()
                return {}, error.exit_code
