"""Compiled kernels are never stale, whoever edits what; and that they cannot be kept or read ends no run."""

from __future__ import annotations

import hashlib
import os
import shutil

import pytest

from support.program_copy import ProgramCopy, unwritable

pytestmark = pytest.mark.slow

LENGTH = 27**0.5  # from (0, 1, 2) to (3, 4, 5)
COMPILING = "compiling numerical kernels"


@pytest.fixture
def program(tmp_path):
    return ProgramCopy(tmp_path)


@pytest.fixture
def warm(program):
    """The copy with its kernels compiled."""
    assert program.lengths()[0] == pytest.approx([LENGTH])
    return program


def test_an_edit_of_a_kernel_that_another_file_imports_is_seen_by_process_and_worker(warm):
    warm.edit("elements/sliding_cable.py", "length = np.sqrt(", "length = 1.5 * np.sqrt(")
    found, said = warm.lengths("worker")
    assert found == pytest.approx([1.5 * LENGTH] * 2)
    assert said.count(COMPILING) == 1
    warm.edit("elements/sliding_cable.py", "length = 1.5 * np.sqrt(", "length = np.sqrt(")
    found, said = warm.lengths("worker")  # both states are there now
    assert found == pytest.approx([LENGTH] * 2)
    assert said == ""


def test_a_constant_that_a_kernel_imports_counts_like_a_kernel(warm):
    warm.edit("elements/sliding_cable.py", "REST, STIFFNESS, DAMPING, LEAD = range(4)", "LEAD = 3\nREST = 0")
    assert COMPILING in warm.lengths()[1]


def test_copies_of_the_program_share_their_kernels_and_a_folder_of_them_can_be_shipped(warm, tmp_path):
    other = ProgramCopy(tmp_path / "other")
    shutil.copytree(warm.home / ".cache" / "tcrctl", other.package / "__pycache__")
    found, said = other.lengths()
    assert found == pytest.approx([LENGTH])
    assert said == ""
    assert other.kernels == []


def cut(content):
    return content[: len(content) // 2]


def flipped(content):
    """One bit in the middle, which is machine code."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


def empty(content):
    del content
    return b""


def foreign(content):
    """What another program has put there, with a digest that fits."""
    del content
    return hashlib.sha256(b"no pickle").digest() + b"no pickle"


@pytest.mark.parametrize(
    "damage",
    [flipped, *(pytest.param(damage, marks=pytest.mark.thorough) for damage in (cut, empty, foreign))],
)
def test_a_damaged_file_is_dropped_and_made_again(warm, damage):
    before = {path: path.read_bytes() for path in warm.kernels}
    assert before
    for path, content in before.items():
        path.write_bytes(damage(content))
    found, said = warm.lengths()
    assert found == pytest.approx([LENGTH])
    assert COMPILING in said
    assert set(warm.kernels) == set(before)
    assert warm.lengths() == (found, "")


def test_a_pipe_in_place_of_a_kernel_keeps_nobody_waiting(warm):
    for path in warm.kernels:
        path.unlink()
        os.mkfifo(path)
    found, said = warm.lengths()
    assert found == pytest.approx([LENGTH])
    assert COMPILING in said
    assert all(path.is_file() for path in warm.kernels)


@pytest.mark.parametrize("home", [None, "", "~", "relative", "a file"])
def test_where_nothing_can_be_written_kernels_are_compiled_each_time_and_it_is_said_once(program, home):
    for folder in [program.package, *program.package.rglob("*")]:
        if folder.is_dir():
            unwritable(folder / "__pycache__")
    before = set(program.folder.rglob("*"))
    given = str(unwritable(program.folder / "file")) if home == "a file" else home
    before.add(program.folder / "file")
    nowhere = {"HOME": given, "NUMBA_CACHE_DIR": "~unknown/cache", "TMPDIR": "/dev/null"}
    script = "import tempfile; tempfile.tempdir = '/dev/null'; import runpy; "
    done = program.python("-c", script + "runpy.run_path('script.py', run_name='__main__')", **nowhere)
    assert float(done.stdout) == pytest.approx(LENGTH)
    assert done.stderr.count("cannot be kept") == 1
    assert len(done.stderr.splitlines()) == 1
    assert set(program.folder.rglob("*")) - before == set()


def test_without_a_home_and_a_place_of_its_own_kernels_go_to_a_private_temporary_folder(program):
    unwritable(program.package / "__pycache__")
    assert "kept in " + str(program.temporary) in program.lengths(HOME=None)[1]
    assert program.lengths(HOME=None)[1] == ""
    assert not (program.folder / "work" / "~").exists()


def test_a_disk_that_is_full_ends_no_run_and_is_said(program, tiny_filesystem):
    (tiny_filesystem / "filling").write_bytes(bytes(230_000))
    found, said = program.lengths(NUMBA_CACHE_DIR=str(tiny_filesystem))
    assert found == pytest.approx([LENGTH])
    assert "No space left" in said
    assert not list(tiny_filesystem.rglob("*.part"))


def test_the_users_folder_is_taken_and_it_alone(program):
    chosen = program.folder / "chosen"
    assert f"kept in {chosen / 'tcrctl' / 'kernels'}" in program.lengths(NUMBA_CACHE_DIR=str(chosen))[1]
    assert program.kernels == []
    assert COMPILING in program.lengths()[1]  # elsewhere they are not known
    shutil.rmtree(chosen)
    assert COMPILING in program.lengths(NUMBA_CACHE_DIR=str(chosen))[1]  # a cold start can be asked for


EDITED_MEANWHILE = """
import sys
from script import length
from pathlib import Path
import tcrctl.elements.sliding_cable as edited
path = Path(edited.__file__)
path.write_text(path.read_text().replace("length = np.sqrt(", "length = 1.5 * np.sqrt("))
print(length())
"""


def test_what_a_process_compiles_after_its_sources_were_edited_is_not_kept(program):
    assert float(program.python("-c", EDITED_MEANWHILE).stdout) == pytest.approx(LENGTH)
    assert program.kernels == []
    assert program.lengths()[0] == pytest.approx([1.5 * LENGTH])


ALL_KERNELS = """
import importlib, sys
if sys.argv[1] == "numba first":
    import numba
from tcrctl.caches.kernel_sources import kernel_sources
modules = [importlib.import_module(name) for name in sorted(kernel_sources().modules)]
from numba.core.dispatcher import Dispatcher
from tcrctl.caches.kernel_cache import KernelCache
kernels = {k for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)}
print(len(kernels), {type(k._cache).__name__ for k in kernels if k.targetoptions.get("inline") != "always"})
import numba
from script import length
print(type(numba.njit(cache=True)(length)._cache).__name__)
"""


@pytest.mark.parametrize("order", ["numba first", "numba later"])
def test_every_kernel_has_this_cache_and_kernels_of_others_have_numbas(program, order):
    kernels, others = program.python("-c", ALL_KERNELS, order).stdout.splitlines()
    count, caches = kernels.split(" ", 1)
    assert int(count) > 100
    assert caches == "{'KernelCache'}"
    assert others == "FunctionCache"
