"""Pages of the command line: for every verb its help, and what it says in a session that is really held."""

from __future__ import annotations

import io
import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from tcrctl.cli.app import VERBS, main
from tcrctl.cli.rig.verbs import RIG_VERBS

#: What is typed, in this order and in one folder, by the verb on whose page it stands.
SESSION: Final = (
    ("list", "tcrctl list"),
    ("kinds", "tcrctl kinds"),
    ("new", "tcrctl new my_path"),
    ("validate", "tcrctl validate my_path.yaml"),
    ("show", "tcrctl show my_path.yaml --set plant.mismatch=off"),
    ("schema", "tcrctl schema"),
    ("run", "tcrctl run dynamic_10s"),
    ("run", "tcrctl run dynamic_10s --seed 2 --set plant.mismatch=off --json"),
    ("runs", "tcrctl runs --where 'spec=dynamic_10s' --sort position_error_mm.max"),
    ("info", "tcrctl info logs/latest"),
    ("replay", "tcrctl replay logs/latest"),
    ("diff", "tcrctl diff logs/*_dynamic_10s_*/"),
    ("export", "tcrctl export logs/latest --csv"),
    ("plot", "tcrctl plot logs/latest --figure error --figure tensions"),
    ("report", "tcrctl report logs/latest"),
    ("recover", "tcrctl recover logs/latest -o recovered.mcap"),
    ("workspace", "tcrctl workspace tcr5x4 --rays 8"),
)
#: Exit codes other than 0 that are what the page is about.
EXPECTED: Final = {"diff": 3}
LONGEST: Final = 48
WIDTH: Final = 100


def write(folder: Path) -> None:
    """Write a page for every verb, and one that lists them."""
    folder.mkdir()
    calls = [[name] for name in VERBS] + [["rig", name] for name in RIG_VERBS]
    with TemporaryDirectory() as work, in_folder(Path(work)):
        _write(folder, calls, session(work))


def _write(folder: Path, calls: list[list[str]], said: dict[str, list[str]]) -> None:
    for call in calls:
        examples = "\n".join(said.get(" ".join(call), ()))
        (folder / f"{'-'.join(call)}.md").write_text(page(call, examples), encoding="utf-8")
    names = "\n".join("-".join(call) for call in calls)
    (folder / "index.md").write_text(
        f"# Commands\n\nHelp and output on these pages were printed by the program while they were made.\n\n"
        f"{console('tcrctl --help', told(['--help'])[1])}\n```{{toctree}}\n:maxdepth: 1\n\n{names}\n```\n",
        encoding="utf-8",
    )


def page(call: list[str], examples: str) -> str:
    """Return the page of a verb."""
    command = " ".join(["tcrctl", *call])
    _, text = told([*call, "--help"])
    shown = f"## What it says\n\n{examples}" if examples else ""
    return f"# {command}\n\n{console(f'{command} --help', text, longest=None)}\n{shown}"


def session(folder: str) -> dict[str, list[str]]:
    """Hold the session in the working directory, a folder; return what stands on the terminal, by verb.

    Raises:
        RuntimeError: If a command ends otherwise than it should.
    """
    said: dict[str, list[str]] = {}
    for verb, command in SESSION:
        code, text = told(expanded(command))
        if code != EXPECTED.get(verb, 0):
            raise RuntimeError(f"{command}: exit code {code}\n{text}")
        said.setdefault(verb, []).append(console(command, text.replace(f"{folder}/", "")))
    return said


def expanded(command: str) -> list[str]:
    """Return the arguments of a command, with the files that patterns stand for."""
    _, *arguments = shlex.split(command)
    found = []
    for argument in arguments:
        files = sorted(map(str, Path().glob(argument))) if "*" in argument else []
        found += files or [argument]
    return found


def told(arguments: list[str]) -> tuple[int, str]:
    """Return the exit code of a call, and what a terminal without colours shows of it."""
    shown = io.StringIO()
    with redirect_stdout(shown), redirect_stderr(shown):
        code = main(arguments)
    return code, "\n".join(line.rstrip() for line in shown.getvalue().strip().splitlines())


def console(command: str, text: str, longest: int | None = LONGEST) -> str:
    """Return a block that shows a command and its output, at most so many lines of it."""
    lines = text.splitlines()
    if longest is not None and len(lines) > longest:
        lines = [*lines[:longest], f"... and {len(lines) - longest} more lines"]
    body = "\n".join([f"$ {command}", *lines])
    return f"````console\n{body}\n````\n"


@contextmanager
def in_folder(folder: Path) -> Iterator[None]:
    """Work in a folder, on a terminal of a certain width."""
    before, settings = Path.cwd(), {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "TERM": "dumb"}
    kept = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
        for name, value in kept.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


if __name__ == "__main__":
    write(Path(sys.argv[1]))
