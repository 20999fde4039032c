"""What nobody means to type is one clear line and the right exit code, never an internal error."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys

import pytest

from support import records
from support.log_files import open_log
from support.short_runs import ROOT
from tcrctl.cli.app import VERBS, main
from tcrctl.config.budget import MAX_BYTES
from tcrctl.errors import DeviceError
from tcrctl.experiment.run_folder import replace_file

#: Verbs whose first argument is a file or a name, or that have an option that takes one.
EMPTY = [
    *([verb, ""] for verb in VERBS if verb not in ("list", "kinds", "schema", "paper")),
    ["run", "letter_t", "--out", ""],
    ["export", "log.mcap", "--csv", "-o", ""],
    ["rig", "check", ""],
    ["runs", "--where", "", "--json"],
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with open_log(tmp_path / "log.mcap") as log:
        for k in range(3):
            log.step(records.record(k))
        log.finish({"status": "success"})
    (tmp_path / "a_file").write_text("")
    return tmp_path


def said(capsys, *arguments):
    code = main(list(arguments))
    return code, capsys.readouterr()


@pytest.mark.parametrize("arguments", EMPTY, ids=" ".join)
def test_an_empty_argument_is_refused(arguments, here, capsys):
    before = sorted(os.listdir())
    code, printed = said(capsys, *arguments)
    assert code == 2
    assert printed.err.splitlines()[0].startswith(f"error: argument {arguments.index('') + 1} is empty")
    if "--json" in arguments:
        assert json.loads(printed.out)["status"] == "error"
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["new", "a_file/x"],
        ["new", "--robot", "a_file/x"],
        ["export", "log.mcap", "--csv", "-o", "a_file/x.csv"],
        ["export", "log.mcap", "--npz", "-o", "a_file/x.npz"],
        ["plot", "log.mcap", "--out", "a_file", "-f", "timing"],
        ["report", "log.mcap", "-o", "a_file/x.html"],
    ],
    ids=" ".join,
)
def test_a_file_where_a_folder_should_be_is_named(arguments, here, capsys):
    code, printed = said(capsys, *arguments)
    assert code == DeviceError.exit_code
    assert printed.err.endswith("a_file is a file, not a folder\n")


def test_export_makes_its_folder(here, capsys):
    assert said(capsys, "export", "log.mcap", "--csv", "-o", "deep/er/x.csv")[0] == 0
    assert sorted(os.listdir("deep/er")) == ["x.csv", "x.events.csv"]


def test_a_device_stays_a_device(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    replace_file(pipe, "a page")
    assert os.read(reader, 100) == b"a page"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert os.listdir(tmp_path) == ["pipe"]


@pytest.mark.parametrize("verb", ["run", "validate", "stability"])
def test_a_log_of_any_size_is_recognised_by_its_bare_name(verb, here, capsys):
    with open("log.mcap", "ab") as log:
        log.truncate(MAX_BYTES + 1)
    code, printed = said(capsys, verb, "log.mcap")
    assert code == 2
    assert "log.mcap: this is a log, not an experiment" in printed.err


def test_names_that_no_run_has_are_told(here, capsys):
    folder = here / "logs" / "one"
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps({"run_id": "one", "status": "success", "seed": 1}))
    code, printed = said(capsys, "runs", "logs", "--where", "sed=1", "--sort", "-statis")
    assert code == 0
    assert [line.split()[-1] for line in printed.err.splitlines()] == ["sed", "statis", "sed=1"]
    told = said(capsys, "runs", "logs", "--where", "seed=2", "--sort", "status")[1].err
    assert told == "no run in logs with seed=2\n"


@pytest.mark.parametrize(
    "arguments", [["validate", "letter_t"], ["diff", "log.mcap", "log.mcap"]], ids=" ".join
)
def test_quiet_verbs_say_nothing_but_errors(arguments, here, capsys):
    code, printed = said(capsys, *arguments, "-q")
    assert (code, printed.out, printed.err) == (0, "", "")
    code, printed = said(capsys, arguments[0], *["nothing.yaml"] * (len(arguments) - 1), "--quiet")
    assert code == 2
    assert printed.out == ""
    assert printed.err.startswith("error: nothing.yaml: ")


@pytest.mark.slow
def test_a_working_directory_that_is_gone_is_named(tmp_path):
    program = (
        f"import os, sys; os.rmdir({str(tmp_path)!r}); from tcrctl.cli.app import main; sys.exit(main())"
    )
    paths = {"PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"}
    done = subprocess.run(
        [sys.executable, "-c", program, "run", "letter_t"],
        cwd=tmp_path,
        env={**os.environ, **paths},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == DeviceError.exit_code
    assert "error: the folder that the program was started in is gone" in done.stderr
