"""Two kinds of compiled functions: what Python calls is a kernel, what only kernels call a part."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tcrctl.caches.kernel_sources import PACKAGE
from tcrctl.numerics.kernel import Part, kernel, part

KINDS = {"kernel", "part"}


def module_name(path: Path) -> str:
    return ".".join(("tcrctl", *path.relative_to(PACKAGE).with_suffix("").parts))


def kind(function: ast.AST) -> str | None:
    """``kernel`` or ``part``; None if it is plain Python."""
    for found in getattr(function, "decorator_list", ()):
        name = getattr(getattr(found, "func", None), "id", None)
        if name in KINDS:
            return name
    return None


def names(tree: ast.Module, module: str, compiled: set[str]) -> dict[str, str]:
    """What the names of a module stand for."""
    found = {name.rpartition(".")[2]: name for name in compiled if name.rpartition(".")[0] == module}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            found |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    return found


def mentions(node: ast.AST, known: dict[str, str]) -> Iterator[str]:
    """Yield what plain Python within a node mentions."""
    if kind(node):
        return
    if isinstance(node, ast.Name):
        yield known.get(node.id, "")
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        yield f"{known.get(node.value.id, '')}.{node.attr}"
    for child in ast.iter_child_nodes(node):
        yield from mentions(child, known)


@pytest.mark.slow
def test_what_plain_python_calls_is_a_kernel_and_all_else_a_part():
    trees = {module_name(path): ast.parse(path.read_text()) for path in PACKAGE.rglob("*.py")}
    kinds = {f"{m}.{n.name}": kind(n) for m, tree in trees.items() for n in ast.walk(tree) if kind(n)}
    assert len(kinds) > 200
    called = {f for m, tree in trees.items() for f in mentions(tree, names(tree, m, set(kinds)))}
    kernels = {name for name, found in kinds.items() if found == "kernel"}
    assert kernels == called & set(kinds)


@part()
def shifted(values: np.ndarray, by: float) -> np.ndarray:
    """Add a number to an array, and refuse to subtract one."""
    if by < 0.0:
        raise ValueError("by", by)  # built at run time: the part's own variables are needed for it
    return values + by


@kernel()
def shifted_twice(values: np.ndarray, by: float) -> np.ndarray:
    return shifted(shifted(values, by), by)


def test_a_part_gives_the_same_from_python_and_from_kernels():
    values = np.linspace(0.0, 1.0, 7)
    assert isinstance(shifted, Part)
    assert np.array_equal(shifted(shifted(values, 0.1), 0.1), shifted_twice(values, 0.1))
    assert all(not library._made for library in libraries(shifted))
    assert all(library._made for library in libraries(shifted_twice))


def libraries(function):
    return [found.library for found in function.overloads.values()]


def test_what_a_part_raises_reaches_python():
    with pytest.raises(ValueError, match="by") as caught:
        shifted_twice(np.zeros(2), -1.5)
    assert caught.value.args == ("by", -1.5)


OLDER_NUMBA = """
import numpy as np
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary
assert "serialize_using_bitcode" in vars(CPUCodeLibrary)
CPUCodeLibrary.as_bitcode = CPUCodeLibrary.serialize_using_bitcode
del CPUCodeLibrary.serialize_using_bitcode
from tcrctl.numerics.late_code import make_code_late
from tcrctl.numerics.rotation import angle_between
assert not make_code_late()
print(angle_between(np.eye(3)[0], np.eye(3)[1]))
"""


@pytest.mark.slow
def test_a_numba_with_other_names_works_as_it_always_does(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    done = subprocess.run([sys.executable, "-c", OLDER_NUMBA], capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(np.pi / 2)


KEPT = """
import numpy as np
from numba import njit
from tcrctl.numerics.rotation import angle_between

x, y = np.eye(3)[0], np.eye(3)[1]
first = angle_between(x, y)
library, = (found.library for found in angle_between.overloads.values())
kept = library._kept is not None

@njit
def twice(x, y):
    return 2.0 * angle_between(x, y)

second = twice(x, y)
assert library._kept is None
assert library.get_pointer_to_function("nowhere_defined") == 0
print(kept, first, second, angle_between(x, y))
"""


@pytest.mark.slow
def test_the_bitcode_of_a_kept_kernel_is_read_by_who_calls_it_and_no_run_needs_it(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    for was_kept in ("False", "True"):
        done = subprocess.run([sys.executable, "-c", KEPT], capture_output=True, text=True, check=True)
        kept, *angles = done.stdout.split()
        assert kept == was_kept
        assert [float(a) for a in angles] == pytest.approx([np.pi / 2, np.pi, np.pi / 2])
