"""A message that cannot be delivered ends nothing and changes nothing."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from contextlib import suppress

import pytest

from support.short_runs import ROOT
from tcrctl.cli.app import main
from tcrctl.cli.consent import check_can_ask
from tcrctl.cli.streams import PATIENCE_S, Output, robust_streams
from tcrctl.errors import InputError

PROGRAM = f"{sys.executable} -m tcrctl.cli.app"


def shell(command, **variables):
    """Exit code, stdout and stderr of a line of shell; ``tcrctl`` stands for the program."""
    paths = {"PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command.replace("tcrctl", PROGRAM)],
        env={**os.environ, **paths, **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=60,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def pipe():
    reading, writing = os.pipe()
    yield reading, writing
    for fd in (reading, writing):
        with suppress(OSError):
            os.close(fd)


def open_text(fd):
    return os.fdopen(fd, "w", encoding="utf-8", closefd=False)


@pytest.mark.parametrize("patience", [None, PATIENCE_S])
def test_a_reader_that_has_gone_is_remembered_and_nothing_is_raised(pipe, patience):
    os.close(pipe[0])
    stream = Output(open_text(pipe[1]), patience)
    for _ in range(3):
        print("a message", file=stream, flush=True)
    assert isinstance(stream.failure, BrokenPipeError)


def test_a_reader_that_does_not_read_costs_a_message_a_moment_once(pipe):
    stream = Output(open_text(pipe[1]), PATIENCE_S)
    for _ in range(2000):  # 400 kB do not fit a pipe: a stream that waits would wait for ever
        print("x" * 200, file=stream)
    assert stream.failure is None
    held = os.read(pipe[0], 2**20)
    print("again", file=stream)
    assert os.read(pipe[0], 2**20).endswith(b"again\n")
    assert held.startswith(b"x" * 200)


def test_data_waits_for_its_reader_also_where_the_pipe_is_said_not_to_wait(pipe):
    reading, writing = pipe
    os.set_blocking(writing, False)
    child = subprocess.Popen(["wc", "-c"], stdin=reading, stdout=subprocess.PIPE)
    with open_text(writing) as inner:
        stream = Output(inner)
        print("y" * 500_000, file=stream)
        stream.flush()
    os.close(writing)
    assert int(child.communicate()[0]) == 500_001


@pytest.mark.parametrize("missing", [None, "closed"])
def test_streams_that_are_missing_take_messages_and_are_no_terminal(missing, monkeypatch):
    for name in ("stdin", "stdout", "stderr"):
        gone = io.StringIO()
        gone.close()
        monkeypatch.setattr(sys, name, None if missing is None else gone)
    for stage in ("bare", "replaced"):
        if stage == "bare":
            with pytest.raises(InputError, match="no terminal to ask on"):
                check_can_ask()
            continue
        with robust_streams():
            print("data")
            print("message", file=sys.stderr)
            with pytest.raises(InputError, match="no terminal to ask on"):
                check_can_ask()
    assert main(["validate", "letter_t"]) == 0
    assert main(["validate", "no_such_experiment"]) == 2


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-16"])
def test_letters_that_an_encoding_lacks_are_spelt_out(encoding):
    for inner in (io.TextIOWrapper(io.BytesIO(), encoding), io.StringIO()):
        stream = Output(inner)
        print("angle \u03b1, a lone \udcff", file=stream, flush=True)
        assert stream.failure is None


def test_a_signal_handler_may_speak_in_the_middle_of_a_message(pipe, monkeypatch):
    stream = Output(open_text(pipe[1]), PATIENCE_S)
    write, said = os.write, []

    def interrupted(fd, data):
        if not said:
            said.append(True)
            print("stopped", file=stream)
        return write(fd, data)

    monkeypatch.setattr(os, "write", interrupted)
    print("message", file=stream)
    assert os.read(pipe[0], 100) == b"stopped\nmessage\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("tcrctl schema | head -1", 0),
        ("tcrctl --help | true", 0),
        ("tcrctl schema >/dev/full", 5),
        ("tcrctl validate letter_t 2>&-", 0),
        ("tcrctl validate no_such_experiment >/dev/full 2>/dev/full", 2),
        ("tcrctl validate no_such_experiment 2>&- >&- <&-", 2),
        ("tcrctl run letter_t --set plant.kind=rig --set plant.rig=loopback <&-", 2),
        ("tcrctl run letter_t --dry-run --force >/dev/full", 0),
    ],
)
def test_the_exit_code_is_what_it_would_be(command, code, tmp_path):
    found, _, said = shell(f"cd {tmp_path} && {command}")
    assert found == code
    assert b"Traceback" not in said
    assert b"internal error" not in said


@pytest.mark.slow
def test_messages_do_not_get_into_the_data_where_there_is_no_place_for_them():
    for command in ("tcrctl run no_such_experiment --json 2>&-", "tcrctl run no_such_experiment --json"):
        code, data, _ = shell(command)
        assert code == 2
        assert data.count(b"\n") == 1
        assert data.startswith(b'{"status": "error"')


@pytest.mark.slow
def test_no_file_takes_the_number_of_a_closed_stream(tmp_path):
    code, *_ = shell(f"cd {tmp_path} && tcrctl new mine 2>&- >&- <&-")
    assert code == 0
    assert "mine.yaml" not in (tmp_path / "mine.yaml").read_text()  # what is said on stdout
