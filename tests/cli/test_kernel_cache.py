"""Compiled kernels have a place even where the program's own folder cannot be written."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile

import pytest

import tcrctl
from tcrctl.cli.kernel_cache import PACKAGE, VARIABLE, is_writable, keep_kernels, kernel_key

#: Runs a verb, then compiles the smallest kernel there is, as a run would.
PROGRAM = """
import sys; sys.path.insert(0, sys.argv[1])
from tcrctl.cli.app import main
assert main(["--version"]) == 0
import numpy as np
from tcrctl.elements.bar import direction
from tcrctl.experiment.compilation import announced_compilation
with announced_compilation(lambda text: print(text, file=sys.stderr)):
    direction(np.zeros(12), 0, 3)
"""


def unwritable(folder):
    """A folder in which nobody can make files, not even root: it is a file."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("")
    return folder


@pytest.fixture
def package(tmp_path):
    """Sources beside which no kernel can be kept."""
    unwritable(tmp_path / "package" / "elements" / "__pycache__")
    (tmp_path / "package" / "kernel.py").write_text("import numba\n")
    return tmp_path / "package"


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_beside_the_sources_if_that_can_be_written(tmp_path):
    environment = {}
    keep_kernels(environment, tmp_path)
    assert environment == {}


def test_where_the_user_says(package, tmp_path):
    environment = {VARIABLE: str(tmp_path / "mine")}
    keep_kernels(environment, package)
    assert environment == {VARIABLE: str(tmp_path / "mine")}


@pytest.mark.skipif(sys.platform == "win32", reason="XDG")
@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME"])
def test_in_the_users_cache_else(package, tmp_path, variable):
    environment = {variable: str(tmp_path / "user")}
    keep_kernels(environment, package)
    cache = tmp_path / "user" / ".cache" if variable == "HOME" else tmp_path / "user"
    assert environment[VARIABLE] == str(cache / "tcrctl" / "kernels" / kernel_key(package))
    assert is_writable(cache)


def test_in_a_temporary_folder_if_nothing_else_is_left(package, tmp_path, temporary):
    home = unwritable(tmp_path / "home")
    for given in ({}, {VARIABLE: str(home / "mine")}):
        environment = {"HOME": str(home), **given}
        keep_kernels(environment, package)
        assert environment[VARIABLE].startswith(str(temporary))


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners of files")
@pytest.mark.parametrize("trap", ["open to all", "a link"])
def test_a_temporary_folder_that_others_could_have_filled_is_not_used(package, tmp_path, temporary, trap):
    place = temporary / f"tcrctl-{os.getuid()}"
    if trap == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        place.symlink_to(tmp_path / "elsewhere")
    else:
        place.mkdir()
        place.chmod(0o777)
    environment = {}
    keep_kernels(environment, package)
    assert environment[VARIABLE].startswith(str(temporary))
    assert not environment[VARIABLE].startswith(str(place) + os.sep)


def test_another_state_of_the_sources_has_other_kernels(package):
    before = kernel_key(package)
    (package / "table.py").write_text("no kernel\n")
    assert kernel_key(package) == before
    (package / "kernel.py").write_text("import numba\n\n")
    assert kernel_key(package) != before


@pytest.mark.slow
def test_a_program_that_cannot_write_beside_itself_keeps_its_kernels_in_the_cache_and_says_where(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "site" / "tcrctl", ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [*(tmp_path / "site" / "tcrctl").rglob("*")]:
        if folder.is_dir():
            unwritable(folder / "__pycache__")
    environment = {**os.environ, "HOME": str(tmp_path / "home")}
    for name in (VARIABLE, "XDG_CACHE_HOME"):
        environment.pop(name, None)
    said = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM, str(tmp_path / "site")],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stderr
        for _ in range(2)
    ]
    cache = tmp_path / "home" / ".cache" / "tcrctl" / "kernels"
    assert f"kept in {cache}" in said[0]
    assert said[1] == ""
    assert list(cache.rglob("*.nbi"))
    assert tcrctl.__file__ != str(tmp_path / "site" / "tcrctl" / "__init__.py")
