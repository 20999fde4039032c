"""A copy of the program that a test may edit, and a script that runs a kernel of it, here and in a worker."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import tcrctl

#: Prints the length that ``rubbing_cable.measure`` finds with ``sliding_cable.segment``, which it imports.
SCRIPT = """
import sys
import numpy as np
from tcrctl.elements.rubbing_cable import Stretches, measure
from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import outcomes
from tcrctl.experiment.compilation import announced_compilation

def length(_=None):
    s = Stretches(*map(np.zeros, (2, (2, 3), 2, 2, 2, 2, 2, (2, 12))), np.zeros(1, int), *map(np.zeros, (1, 1)))
    robot = np.array([0, 2]), np.array([[0, 0, 0], [1, 1, 1]]), np.full((2, 3), 1 / 3), np.ones((1, 4))
    for part in robot:
        part.flags.writeable = False  # as in every robot
    measure(np.arange(12.0), np.zeros(1), *robot, s)
    return float(s.length[1])

if __name__ == "__main__":
    with announced_compilation(lambda text: print(text, file=sys.stderr)):
        print(length())
    if sys.argv[1:] == ["worker"]:
        for _, found in outcomes(Engine(jobs=1), length, [0]):
            print(found)
"""
#: What settings of the computer at hand say about folders.
FOLDERS = (
    "HOME",
    "XDG_CACHE_HOME",
    "XDG_CONFIG_HOME",
    "NUMBA_CACHE_DIR",
    "MPLCONFIGDIR",
    "TMPDIR",
    "PYTHONPATH",
)


class ProgramCopy:
    """The copy in a folder, which also has a home and a folder for temporary files."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.package = folder / "site" / "tcrctl"
        self.home = folder / "home"
        self.temporary = folder / "temporary"
        for place in (folder / "work", self.home, self.temporary):
            place.mkdir(parents=True)
        (folder / "work" / "script.py").write_text(SCRIPT)
        shutil.copytree(
            Path(tcrctl.__file__).parent, self.package, ignore=shutil.ignore_patterns("__pycache__", "*.nbc")
        )

    @property
    def kernels(self) -> list[Path]:
        """Files of compiled kernels in the home."""
        return sorted(self.home.rglob("*.nbc"))

    def edit(self, module: str, old: str, new: str) -> None:
        path = self.package / module
        assert path.read_text().count(old) == 1
        path.write_text(path.read_text().replace(old, new))

    def python(self, *arguments: str, **variables: str | None) -> subprocess.CompletedProcess[str]:
        """Run Python in the folder ``work``; a variable of None is not set."""
        environment = {name: value for name, value in os.environ.items() if name not in FOLDERS}
        places = {
            "HOME": str(self.home),
            "TMPDIR": str(self.temporary),
            "PYTHONPATH": str(self.package.parent),
        }
        environment.update({"NUMBA_OPT": "1", "PYTHONDONTWRITEBYTECODE": "1", **places})
        for name, value in variables.items():
            environment.pop(name, None)
            if value is not None:
                environment[name] = value
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder / "work",
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )

    def lengths(self, *arguments: str, **variables: str | None) -> tuple[list[float], str]:
        """Run the script; return what it found, and what was said."""
        done = self.python("script.py", *arguments, **variables)
        return [float(line) for line in done.stdout.split()], done.stderr


def unwritable(folder: Path) -> Path:
    """Make a folder in which nobody can make files, not even root: it is a file."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("")
    return folder
