"""The rules of the code base: layers, style, types, and sizes."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "tcrctl").rglob("*.py")) + sorted((ROOT / "hardware").rglob("*.py"))

LONGEST_FILE = 300
LONGEST_FUNCTION = 60
HEAVY = {"numba", "numpy", "scipy", "mcap", "matplotlib", "google.protobuf", "pydantic"}

CHECKS = {
    "layers": ["-c", "from importlinter.cli import lint_imports_command as check; check()"],
    "lint": ["-m", "ruff", "check", "."],
    "format": ["-m", "ruff", "format", "--check", "."],
    "types": ["-m", "mypy"],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_the_code_passes_its_static_checks(name):
    done = subprocess.run(
        [sys.executable, *CHECKS[name]], cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_no_imports_go_round_in_a_circle():
    graph = grimp.build_graph("tcrctl", "tcr_hardware")
    arrows = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    TopologicalSorter(arrows).prepare()  # raises CycleError, which names the circle


def test_no_file_is_too_long():
    lines = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in SOURCES}
    assert SOURCES
    assert {name: count for name, count in lines.items() if count > LONGEST_FILE} == {}


def length(function):
    """Lines of a function from its ``def`` on, without the docstring."""
    first = function.body[0]
    documented = ast.get_docstring(function) is not None
    return function.end_lineno - function.lineno + 1 - documented * (first.end_lineno - first.lineno + 1)


@pytest.mark.slow
def test_no_function_is_too_long():
    too_long = {
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name}": length(node)
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and length(node) > LONGEST_FUNCTION
    }
    assert too_long == {}


def test_the_length_of_a_function_leaves_out_its_docstring():
    (function,) = ast.parse('def f():\n    """One.\n\n    Two.\n    """\n    x = 1\n    return x\n').body
    assert length(function) == 3


def imported(path):
    """Top-level names of the packages that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.partition(".")[0]


def test_the_hardware_package_knows_nothing_of_control():
    offenders = [
        path
        for path in SOURCES
        if "hardware" in path.relative_to(ROOT).parts[:1] and "tcrctl" in imported(path)
    ]
    assert offenders == []


def test_every_cited_source_is_listed_in_the_references():
    cited = {
        (key, str(path.relative_to(ROOT)))
        for path in SOURCES
        for key in re.findall(r"\[(TCR|[A-Z]{2,4}\d{2})\]", path.read_text())
    }
    listed = set(re.findall(r"^\| \[(\w+)\] \|", (ROOT / "REFERENCES.md").read_text(), re.MULTILINE))
    assert cited
    assert {(key, name) for key, name in cited if key not in listed} == set()


def test_the_command_line_starts_without_heavy_packages():
    program = f"import sys, tcrctl.cli.app; print(sorted({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
