"""One command for each check, in the environment that nox is installed in (docs/decisions/11-nox.md).

nox -s lint types fast        # before every commit
nox -s test -- -k replay      # what stands after -- goes to pytest
nox -s thorough               # all tests, those too that are left out by default, with more examples
nox -s docs                   # build the documentation site with all its figures, in build/site
nox -s typed                  # type the commands of every document
nox -s examples               # install the packages in examples/ and run their tests
nox -s pictures bench         # draw the pictures of the documents again, print the tables of cost
nox -s kernels                # write the list of kernels that runs need
nox -s pin                    # write constraints.txt anew
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import nox

nox.options.default_venv_backend = "none"
nox.options.sessions = ["lint", "types", "fast"]

CONSTRAINTS = Path("constraints.txt")
#: Benchmarks that say in a minute each whether something has become slower.
BENCHMARKS = ("control_step", "plant_step", "log_cost", "natnet_decode")


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, format and the direction of imports."""
    session.run("python", "-m", "ruff", "check", ".")
    session.run("python", "-m", "ruff", "format", "--check", ".")
    session.run("lint-imports")


@nox.session
def types(session: nox.Session) -> None:
    """Check types."""
    session.run("python", "-m", "mypy")


@nox.session
def fast(session: nox.Session) -> None:
    """Run the tests that take less than a second each."""
    session.run("python", "-m", "pytest", "-m", "fast", *session.posargs)


@nox.session
def test(session: nox.Session) -> None:
    """Run all tests but those that repeat at length what a shorter one states."""
    session.run("python", "-m", "pytest", *session.posargs)


@nox.session
def thorough(session: nox.Session) -> None:
    """Run all tests, with more examples of every property."""
    session.run("python", "-m", "pytest", "-m", "", *session.posargs)


@nox.session
def docs(session: nox.Session) -> None:
    """Check the documents, and build the site; figures of experiments that have one in build/figures are kept."""
    session.run(
        "python", "-m", "pytest", "-n", "0", "tests/test_documents.py", "tests/test_shown_commands.py"
    )
    session.run("python", "docs/site/build.py", "build/site", "--figures", "build/figures")


@nox.session
def typed(session: nox.Session) -> None:
    """Type the commands of every document; a quarter of an hour, on a computer that has time for a bench."""
    session.run("python", "-m", "pytest", "-n", "0", "docs/tests", *session.posargs)


@nox.session
def pictures(session: nox.Session) -> None:
    """Draw the pictures of the documents again."""
    with tempfile.TemporaryDirectory() as folder:
        session.run("tcrctl", "run", "letter_t", "--out", folder)
        (log,) = Path(folder).rglob("log.mcap")
        session.run("python", "docs/draw_letter.py", str(log), "docs/letter_t.png")
    for name in ("robot", "control", "reports"):
        session.run("python", f"docs/draw_{name}.py")


@nox.session
def examples(session: nox.Session) -> None:
    """Install the example packages and run their tests."""
    for pyproject in sorted(Path("examples").glob("*/pyproject.toml")):
        session.run("python", "-m", "pip", "install", "-q", "-c", str(CONSTRAINTS), str(pyproject.parent))
        with session.chdir(pyproject.parent):
            session.run("python", "-m", "pytest", "-q")


@nox.session
def bench(session: nox.Session) -> None:
    """Print what a step of control, plant, log and cameras costs."""
    for name in BENCHMARKS:
        session.run("python", f"benchmarks/{name}.py")


@nox.session
def kernels(session: nox.Session) -> None:
    """Write the list of kernels that runs need, which are compiled ahead of them."""
    session.run("python", "benchmarks/needed_kernels.py", *session.posargs)


@nox.session(venv_backend="venv")
def pin(session: nox.Session) -> None:
    """Install everything in its newest version into a fresh environment, and write down what that was."""
    session.install(".[dev]", "./examples/tcrctl-mujoco")
    versions = session.run("python", "-m", "pip", "freeze", silent=True)
    heading = CONSTRAINTS.read_text().splitlines()[0]
    kept = [line for line in str(versions).splitlines() if re.match(r"[\w.-]+==", line)]
    CONSTRAINTS.write_text("\n".join([heading, *kept]) + "\n")
