"""What the key of compiled kernels covers."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import grimp
import pytest

from tcrctl.caches.kernel_folder import KEPT, KernelFolder, chosen_folder, kernel_key, prune
from tcrctl.caches.kernel_sources import FOLDERS, PACKAGE, kernel_sources
from tcrctl.caches.places import Place

MARK = "from tcrctl.numerics.kernel import"
HARDWARE = PACKAGE.parent / "hardware" / "tcr_hardware"


@pytest.fixture
def package(tmp_path):
    """Sources alone, which may be edited."""
    ignored = shutil.ignore_patterns("__pycache__")
    for folder in FOLDERS:
        shutil.copytree(PACKAGE / folder, tmp_path / "tcrctl" / folder, ignore=ignored)
    for path in PACKAGE.glob("*.py"):
        shutil.copy(path, tmp_path / "tcrctl")
    return tmp_path / "tcrctl"


def module(path: Path) -> str:
    return ".".join(("tcrctl", *path.relative_to(PACKAGE).with_suffix("").parts))


def test_kernels_stand_where_the_key_looks_for_them_only():
    with_kernels = {path for path in PACKAGE.rglob("*.py") if MARK in path.read_text()}
    assert len(with_kernels) > 20
    assert {module(path) for path in with_kernels} <= kernel_sources().modules
    others = {
        path for path in [*PACKAGE.rglob("*.py"), *HARDWARE.rglob("*.py")] if "@numba." in path.read_text()
    }
    assert others == set()
    plain = {path for path in [*PACKAGE.rglob("*.py"), *HARDWARE.rglob("*.py")] if "njit" in path.read_text()}
    assert plain == {PACKAGE / "numerics" / "kernel.py"}


def test_everything_that_a_module_with_kernels_imports_counts():
    graph = grimp.build_graph("tcrctl")
    kernels = {module(path) for path in PACKAGE.rglob("*.py") if MARK in path.read_text()}
    imported = {name for kernel in kernels for name in graph.find_modules_directly_imported_by(kernel)}
    assert imported
    assert imported - kernel_sources().modules == set()
    assert "tcrctl.robot.module" in imported  # sizes of arrays, though sections of files stand beside them


@pytest.mark.parametrize(
    "edited", ["elements/bar.py", "controller/ioc.py", "robot/module.py", "task/perforated_plate.py"]
)
def test_another_state_of_a_kernel_or_of_its_constants_has_another_key(package, edited):
    before = kernel_key(package)
    (package / edited).write_text((package / edited).read_text() + "\n")
    kernel_sources.cache_clear()
    assert kernel_key(package) != before


@pytest.mark.parametrize("edited", ["controller/settings.py", "robot/description.py", "plant/cameras.py"])
def test_nobody_waits_for_the_compiler_because_of_settings_or_plain_python(package, edited):
    before = kernel_key(package)
    (package / edited).write_text((package / edited).read_text() + "\n")
    kernel_sources.cache_clear()
    assert kernel_key(package) == before


def test_another_level_of_optimisation_has_another_key():
    assert kernel_key(options={"OPT": "0"}) != kernel_key(options={"OPT": "3"})


def test_sources_that_were_edited_or_removed_since_are_noticed(package):
    sources = kernel_sources(package)
    assert sources.unchanged()
    (package / "elements" / "bar.py").write_text("")
    assert not sources.unchanged()
    (package / "elements" / "bar.py").unlink()
    assert not sources.unchanged()


def test_folders_that_were_used_longest_ago_are_removed_and_nothing_else(tmp_path):
    folder = KernelFolder("f" * 16, None, (Place(tmp_path),))
    old = [tmp_path / "kernels" / f"{i:016x}" for i in range(KEPT + 3)]
    others = [tmp_path / "kernels" / "bar_0123456789abcdef", tmp_path / "kernels" / "mine"]
    for age, path in enumerate([*old, *others]):
        path.mkdir(parents=True)
        (path / "some.nbc").write_bytes(b"")
        os.utime(path, (1e9 - age, 1e9 - age))
    kept = folder.kept()
    assert set((tmp_path / "kernels").iterdir()) == {kept, *old[: KEPT - 1], *others}
    prune(kept)
    assert len(list((tmp_path / "kernels").iterdir())) == KEPT + 2


def test_the_folder_that_the_user_has_chosen_may_lie_in_the_home_and_is_never_called_tilde(
    monkeypatch, tmp_path
):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert chosen_folder("~/mine") == tmp_path / "mine" / "tcrctl"
    assert chosen_folder("~nobody-of-this-name/mine") is None
    assert chosen_folder("") is None
    monkeypatch.chdir(tmp_path)
    assert chosen_folder("mine") == tmp_path / "mine" / "tcrctl"
