"""The commands of every page, typed in their order; minutes: ``nox -s typed``.

Two pages are typed by the tests of the program (tests/test_shown_commands.py), with all that takes no time.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from support.shown_commands import shown, with_files
from support.typed_commands import is_quick, put_files, shortened, why_not
from tcrctl.cli.app import main

ROOT = Path(__file__).parents[2]
PAGES = [
    path
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    if path.name not in ("start.md", "robot.md")
    and any(not is_quick(command) and not why_not(command) for command in shown(path.read_text()))
]
#: A command that has not reached its criterion has worked: the page shows what it is for.
WORKED = (0, 3)


@pytest.fixture(scope="module")
def emulated():
    """The emulated bench, which the pages say is in another terminal."""
    bench = subprocess.Popen(
        [sys.executable, "-m", "tcrctl.cli.app", "emulate"], stderr=subprocess.PIPE, text=True
    )
    said = iter(bench.stderr or ())
    assert any("is emulated" in line for line in said)
    yield
    bench.terminate()
    bench.communicate()


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_the_commands_of_a_page_work_in_their_order(page, tmp_path, monkeypatch, capsys, request):
    monkeypatch.chdir(tmp_path)
    put_files(tmp_path)
    wrong = []
    for arguments in shown(page.read_text()):
        if why_not(arguments):
            continue
        if "loopback" in " ".join(arguments):
            request.getfixturevalue("emulated")
            arguments = [*arguments, *["--yes"] * (arguments[0] == "run" and "--yes" not in arguments)]
        elif arguments[0] == "emulate":
            continue  # it has just been running
        code = main(with_files(shortened(arguments)))
        said = capsys.readouterr()
        wrong += [(arguments, code, said.err)] if code not in WORKED else []
    assert wrong == []
