"""What is no regular file is refused at once, by whatever verb would read it; ``-`` is not a file of that name."""

from __future__ import annotations

import csv
import io
import os
import signal
import socket

import pytest

from support import records
from support.log_files import open_log
from tcrctl.cli.app import main

#: How long a verb may take to say no [s]; a pipe without a writer would keep it for ever.
SOON_S = 20
SPECS = (
    ("validate",),
    ("validate", "--robot"),
    ("run",),
    ("show",),
    ("stability",),
    ("sweep",),
    ("tune",),
    ("identify",),
    ("workspace",),
    ("rig", "check"),
    ("emulate",),
    ("emulate", "--faults"),
)
LOGS = (("info",), ("recover",), ("export", "--csv"), ("plot",), ("report",), ("play",), ("replay",))
TABLES = (
    ("identify", "--robot", "tcr700", "--params", "springs.youngs_modulus_mpa", "--from"),
    ("run", "letter_t", "--dry-run", "--set", "trajectory.kind=table", "--set", "trajectory.file=odd.csv"),
)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def too_long(*_):
        raise TimeoutError("waits")

    before = signal.signal(signal.SIGALRM, too_long)
    signal.alarm(SOON_S)
    yield tmp_path
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def make(kind, name):
    if kind == "a pipe":
        os.mkfifo(name)
    elif kind == "a folder":
        os.mkdir(name)
    elif kind == "a device":
        os.symlink("/dev/zero", name)
    else:
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(name)


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device", "a folder"])
@pytest.mark.parametrize("verb", [*SPECS, *TABLES, *LOGS], ids=" ".join)
def test_a_verb_says_what_it_is_and_waits_for_nothing(verb, kind, capsys):
    if kind == "a folder" and verb in LOGS:
        pytest.skip("the folder of a run stands for its log")
    name = "odd.mcap" if verb in LOGS else "odd.csv" if verb in TABLES else "odd.yaml"
    make(kind, name)
    assert main([*verb, *([] if "trajectory.file=odd.csv" in verb else [name])]) == 2
    said = capsys.readouterr().err
    assert f"this is {kind}, not a file" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("verb", [verb for verb in SPECS if verb != ("emulate", "--faults")], ids=" ".join)
def test_standard_input_is_refused_with_a_sentence(verb, capsys):
    assert main([*verb, "-"]) == 2
    assert "standard input is not read" in capsys.readouterr().err


@pytest.mark.parametrize("entry", ["summary.json", "tags.json"])
def test_a_pipe_in_the_folder_of_a_run_does_not_keep_the_list_of_runs(entry, here, capsys):
    run = here / "logs" / "a_run"
    run.mkdir(parents=True)
    (run / "summary.json").write_text("{}")
    (run / entry).unlink(missing_ok=True)
    os.mkfifo(run / entry)
    assert main(["runs"]) == 0


@pytest.fixture
def log(here):
    with open_log(here / "log.mcap") as written:
        for k in range(3):
            written.step(records.record(k))
        written.finish({"status": "success"})
    return "log.mcap"


def test_standard_output_takes_the_same_table_as_a_file(log, here, capsys):
    assert main(["export", log, "--csv", "-o", "run.csv"]) == 0
    capsys.readouterr()
    assert main(["export", log, "--csv", "-o", "-"]) == 0
    printed = capsys.readouterr()
    with (here / "run.csv").open(newline="") as file:
        assert list(csv.reader(io.StringIO(printed.out))) == list(csv.reader(file))
    assert printed.err == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ("export", "log.mcap", "--npz", "-o", "-"),
        ("export", "log.mcap", "--parquet", "-o", "-"),
        ("export", "log.mcap", "--csv", "--json", "-o", "-"),
        ("plot", "log.mcap", "--out", "-"),
        ("report", "log.mcap", "-o", "-"),
        ("recover", "log.mcap", "-o", "-"),
        ("replay", "log.mcap", "-o", "-"),
        ("replay", "log.mcap", "--plot", "-"),
        ("stability", "letter_t", "-o", "-"),
        ("run", "letter_t", "--out", "-"),
        ("sweep", "seeds", "--out", "-"),
    ],
    ids=" ".join,
)
def test_where_standard_output_cannot_take_it_no_file_of_that_name_is_made(arguments, log, here, capsys):
    assert main([*arguments]) == 2
    assert "standard output" in capsys.readouterr().err
    assert sorted(os.listdir()) == ["log.mcap"]


def test_an_export_does_not_wait_for_a_reader(log, capsys):
    os.mkfifo("pipe.npz")
    assert main(["export", log, "--npz", "-o", "pipe.npz", "--force"]) == 2
    assert "this is a pipe, not a file" in capsys.readouterr().err
