"""Sections of experiments and rig files whose kinds may come from elsewhere, and what packages have registered."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping, Sequence
from importlib.metadata import EntryPoint
from typing import Final

#: Group of entry points of every section of an experiment.
GROUPS: Final[Mapping[str, str]] = {
    "trajectory": "tcrctl.trajectories",
    "controller": "tcrctl.controllers",
    "estimator": "tcrctl.estimators",
    "plant": "tcrctl.plants",
    "task": "tcrctl.tasks",
}
#: The same of a rig file.
DEVICES: Final[Mapping[str, str]] = {"cameras": "tcrctl.cameras", "plc": "tcrctl.drives"}


def registered(section: str) -> Sequence[EntryPoint]:
    """Return what installed packages have registered for a section, sorted by name; looks at all packages."""
    found = importlib.metadata.entry_points(group={**GROUPS, **DEVICES}[section])
    # a package may be found twice, in a checkout and where it is installed
    different = {(point.name, point.value, package_of(point)): point for point in found}
    return [different[key] for key in sorted(different)]


def package_of(point: EntryPoint) -> str:
    """Return name and version of the package that registered an entry point."""
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"
