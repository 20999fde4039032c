"""Settings of all tests, and the shipped robots, built once per session."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import hypothesis
import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tcrctl.robot.robot import Robot

#: The first example may compile kernels, so no deadline; the same examples every time.
hypothesis.settings.register_profile("thorough", deadline=None, derandomize=True, print_blob=True)
for name, examples in (("usual", 30), ("fast", 20)):
    thorough = hypothesis.settings.get_profile("thorough")
    hypothesis.settings.register_profile(name, thorough, max_examples=examples)
#: Examples of a property that does not say how many it needs, by what is asked for with -m.
PROFILES = {"fast": "fast", "": "thorough", "thorough": "thorough"}


def pytest_configure(config: pytest.Config) -> None:
    """Before numba is imported."""
    hypothesis.settings.load_profile(PROFILES.get(config.option.markexpr, "usual"))
    os.environ.setdefault("NUMBA_OPT", "1")  # as the command line does, so that kernels are the same


def pytest_itemcollected(item: pytest.Item) -> None:
    """What is not marked slow is fast."""
    if item.get_closest_marker("slow") is None:
        item.add_marker("fast")


def shipped(name: str) -> Robot:
    """Build a shipped robot."""
    from tcrctl.robot.description import load_robot
    from tcrctl.robot.robot import build_robot

    return build_robot(load_robot(name))


@pytest.fixture(scope="session")
def tcr600() -> Robot:
    """Single-segment robot: 11 modules, three cables."""
    return shipped("tcr600")


@pytest.fixture(scope="session")
def tcr700() -> Robot:
    """Two-segment robot: 13 modules, six cables."""
    return shipped("tcr700")


@pytest.fixture(scope="session")
def tcr5x4() -> Robot:
    """Short robot: five modules, four cables."""
    return shipped("tcr5x4")


@pytest.fixture
def tiny_filesystem(tmp_path: Path) -> Iterator[Path]:
    """A real file system of 256 KiB, where mounting one is allowed."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("a file system can be mounted by root only")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)
