"""The address of a run: a digest of everything that its numbers depend on.

That is the experiment as it runs, with what is drawn for its plant, its robots, and the program: the sources of all
that an experiment is made of. Imports point down, so what stands above cannot change a number, and a study is not
run again because a figure looks different.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

from tcrctl.experiment.plugged import origins
from tcrctl.experiment.spec import LoadedSpec, with_draws
from tcrctl.experiment.table_file import table_file

_PACKAGE: Final = Path(__file__).parents[1]
#: Parts of the program that stand above experiments, or beside them: they cannot change a number.
ABOVE: Final = (
    "analysis", "api", "caches", "cli", "commissioning", "emulate", "executors", "extend", "identify", "paper",
    "plots", "replay", "report", "stability", "study", "testing", "tune", "view", "workspace",
)  # fmt: skip
#: Packages that kernels and numbers are made with.
_NUMERIC: Final = ("llvmlite", "numba", "numpy", "scipy")
#: Keys of an experiment that say nothing about how it runs; the robot counts by what its file says.
_WORDS: Final = ("description", "source", "robot")


def address(
    loaded: LoadedSpec, seed: int, *, random_path: bool = False, calibration: str | None = None
) -> str:
    """Return the address of a run, 64 hexadecimal digits.

    Args:
        loaded: The experiment.
        seed: Of the run.
        random_path: Whether the seed draws its trajectory.
        calibration: Address of the self-calibration whose result it knows; None without.
    """
    spec = with_draws(loaded.spec, len(loaded.robot.cables.routes), seed).model_dump(mode="json")
    if loaded.plant_robot is not None:
        spec["plant"]["robot"] = None  # the robot itself counts, not what its file is called
    content: dict[str, Any] = {
        "spec": {key: value for key, value in spec.items() if key not in _WORDS},
        "robot": loaded.robot.model_dump(mode="json"),
        "plant_robot": loaded.plant_robot and loaded.plant_robot.model_dump(mode="json"),
        "files": [origin.sha256 for origin in origins(loaded.spec)],
        "samples": [hashlib.sha256(data).hexdigest() for data in table_file(loaded.spec.trajectory).values()],
        "random_path": random_path,
        "calibration": calibration,
        "program": program(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@cache
def program() -> str:
    """Return the digest of the sources that numbers depend on, and of the versions of numerical packages."""
    digest = hashlib.sha256()
    for name, content in _sources():
        digest.update(name.encode() + b"\0" + content + b"\0")
    versions = {name: importlib.metadata.version(name) for name in _NUMERIC}
    digest.update(json.dumps([versions, os.environ.get("NUMBA_OPT", "default")]).encode())
    return digest.hexdigest()


def _sources() -> Iterator[tuple[str, bytes]]:
    hardware = importlib.util.find_spec("tcr_hardware")  # simulated drives are the bench's
    roots = [_PACKAGE, *(Path(p) for p in (hardware and hardware.submodule_search_locations) or ())]
    for root in roots:
        for path in sorted(root.rglob("*.py")):
            place = path.relative_to(root)
            if root != _PACKAGE or place.parts[0].removesuffix(".py") not in ABOVE:
                yield f"{root.name}/{place.as_posix()}", path.read_bytes()
