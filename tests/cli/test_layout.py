"""Tables at every width: all that they hold is there, words are whole, and lines fit into the terminal."""

from __future__ import annotations

import io
import json
import sys
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support import records
from support.engines import stay_here
from support.log_files import open_log
from support.studies import study_file
from tcrctl.cli import paper
from tcrctl.cli.app import main
from tcrctl.cli.console import has_styles
from tcrctl.cli.layout import fact, laid_out, message
from tcrctl.cli.progress import SpokenProgress, kernels_bar
from tcrctl.cli.streams import Messages
from tcrctl.paper.report import Line, make_line
from tcrctl.paper.table import ROWS
from tcrctl.study.address import program
from tcrctl.study.row import Row

WORDS = st.text("abcdefgh", min_size=1, max_size=12)
CELLS = st.lists(WORDS, max_size=12).map(" ".join)
REASON = "letter_t: safety stop at step 3: estimated position error is 80.1 mm, limit 60 mm"


def words(lines):
    return [word for line in lines for word in line.split()]


def fits(lines, columns):
    return all(len(line) <= columns or len(line.split()) == 1 for line in lines)


@given(st.data(), st.integers(1, 5), st.integers(15, 130))
def test_every_word_is_there_and_no_line_is_too_long(data, count, columns):
    row = st.lists(CELLS, min_size=count, max_size=count)
    titles = data.draw(st.lists(WORDS, min_size=count, max_size=count))
    rows = data.draw(st.lists(row, min_size=1, max_size=5))
    head, bodies = laid_out(titles, rows, columns)
    assert len(bodies) == len(rows)
    for cells, lines in zip(rows, bodies, strict=True):
        said = words(lines)
        assert all(said.count(word) >= words(cells).count(word) for word in words(cells))
        assert head == [] or sorted(said) == sorted(words(cells))
        if head or all(len(title) < 6 for title in titles):
            assert all(len(line) <= columns or len(line.split()) <= 2 for line in [*head, *lines])


@given(st.lists(CELLS, min_size=2, max_size=4), st.integers(0, 3))
def test_without_a_width_every_row_is_one_line(row, right):
    head, (lines,) = laid_out(["a"] * len(row), [row], None, [right])
    assert (len(head), len(lines)) == (1, 1)
    assert words(lines) == words(row)


@given(WORDS, CELLS, st.integers(20, 100))
def test_what_belongs_to_a_name_stays_beside_it(name, text, columns):
    lines = fact(name, text, 14, columns)
    assert words(lines) == [name, *text.split()]
    assert fits(lines, columns)


def test_what_is_too_long_to_stand_beside_its_name_stands_below_it():
    assert fact("source", "a" * 64, 20, 80) == ["source", "  " + "a" * 64]


@given(st.lists(CELLS, min_size=1, max_size=4), st.integers(20, 100))
def test_a_message_breaks_between_words_and_keeps_its_lines(lines, columns):
    text = "".join(f"{line}\n" for line in lines)
    told = message(text, columns)
    assert words(told.splitlines()) == words(text.splitlines())
    assert fits(told.splitlines(), columns)
    assert message(text, None) == text


class Terminal(io.StringIO):
    """A terminal that keeps what it was sent."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("variables", "styled"),
    [({"TERM": "xterm"}, True), ({"TERM": "dumb"}, False), ({"TERM": "xterm", "NO_COLOR": "1"}, False)],
    ids=str,
)
def test_escape_codes_go_to_terminals_that_take_them(variables, styled, monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert has_styles(Terminal()) == styled
    assert not has_styles(io.StringIO())
    terminal = Terminal()
    print("\x1b[1mbold\x1b[0m", file=Messages(terminal), flush=True)
    assert ("\x1b" in terminal.getvalue()) == ("NO_COLOR" not in variables)


def test_a_message_on_a_narrow_terminal_is_broken_by_its_stream(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    terminal, pipe = Terminal(), io.StringIO()
    for stream in (terminal, pipe):
        print(f"error: {REASON}", file=Messages(stream), flush=True)
    assert max(map(len, terminal.getvalue().splitlines())) <= 40
    assert pipe.getvalue().count("\n") == 1


def test_a_plain_terminal_is_told_ever_more_rarely_how_long_it_takes(capsys):
    now = iter([0.0, *(0.5 * k for k in range(1, 65))])
    progress = SpokenProgress(lambda: next(now))
    for k in range(1, 65):
        progress.say("letter_t", k, 64)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(":")[1].split()[0] for line in lines] == ["4", "8", "16", "32", "64"]
    assert lines[1] == "letter_t: 8 of 64, 28 s left"


def compiled_on(stream, monkeypatch, **variables):
    """What a stream is sent while kernels are compiled."""
    for name, value in {"TERM": "xterm", "NO_COLOR": "", **variables}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stderr", stream)
    with kernels_bar() as watch:
        for done in range(5):
            watch(done, 8, 4.0 - done if done else None)
    return stream.getvalue()


def test_a_terminal_is_told_how_many_kernels_are_compiled_and_what_is_left_and_a_pipe_is_not(monkeypatch):
    styled = compiled_on(Terminal(), monkeypatch)
    assert "4/8" in styled
    assert "0 s left" in styled
    assert styled.rindex("\x1b[?25h") > styled.rindex("\x1b[?25l")  # the cursor is there again
    assert compiled_on(io.StringIO(), monkeypatch) == ""
    assert "\x1b" not in compiled_on(Terminal(), monkeypatch, TERM="dumb")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "log.mcap"
    criterion = {
        "name": "position_error_mm.max",
        "relation": "<=",
        "limit": 3.0,
        "value": 9.876543,
        "unit": "mm",
    }
    summary = json.dumps({"status": "failed", "criteria": [{**criterion, "passed": False}]})
    with open_log(path) as writer:
        for k in range(5):
            writer.step(records.record(k))
        writer.finish({"status": "failed", "reason": "a criterion failed", "summary": summary})
    return path


def said(capsys, call):
    assert main(call) == 0
    return capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("terminal", [{}, {"NO_COLOR": "1"}, {"TERM": "dumb"}], ids=str)
@pytest.mark.parametrize("columns", [60, 80, 120])
def test_verbs_keep_to_the_width_of_the_terminal(columns, terminal, log, capsys, monkeypatch):
    wide = {}
    calls = [["list"], ["kinds"], ["export", "--columns"], ["info", str(log)]]
    monkeypatch.delenv("COLUMNS", raising=False)
    for call in calls:
        wide[call[0]] = words(said(capsys, call).splitlines()[1:])
    monkeypatch.setenv("COLUMNS", str(columns))
    for name, value in terminal.items():
        monkeypatch.setenv(name, value)
    for call in calls:
        lines = said(capsys, call).splitlines()
        assert all(len(line) <= columns or len(line.split()) <= 2 for line in lines), call
        assert set(wide[call[0]]) <= set(words(lines)) | {word.rstrip(":") for word in words(lines)}, call
        assert "\x1b" not in "".join(lines)


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_paper_says_first_what_failed_and_breaks_no_words(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    lines = [make_line(row, {}) for row in ROWS[:6]]
    lines[3] = Line(ROWS[3], None, "failed", REASON, "", ())
    report = SimpleNamespace(lines=lines, notes=lambda: ["A note."], folder="logs/x")
    paper._print_table(report)
    printed = capsys.readouterr().out.splitlines()
    assert fits(printed, columns)
    text = [" ".join(line.cells()) for line in lines]
    assert set(words(text)) <= set(words(printed))
    first = ROWS[3].work.split()[0]
    assert next(line for line in printed if not line.startswith(("work", " "))).startswith(first)


def test_info_says_what_failed_right_after_the_status_to_four_digits(log, capsys):
    lines = said(capsys, ["info", str(log)]).splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("status"))
    assert lines[at + 1].split(None, 1)[1] == "FAILED: position_error_mm.max is 9.877 mm, must be <= 3 mm"


@pytest.mark.parametrize(("columns", "whole"), [(40, False), (60, False), (80, True), (None, True)])
def test_a_checksum_is_whole_or_says_that_it_is_not(columns, whole):
    digest = "2bed6b9d" * 8
    lines = fact("source_sha256", digest, 27, columns)
    assert columns is None or max(map(len, lines)) <= columns
    assert " ".join(lines).split() == ["source_sha256", digest if whole else f"{digest[:16]}..."]


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_a_study_keeps_to_the_width_of_the_terminal(columns, tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    monkeypatch.setenv("COLUMNS", str(columns))
    result = {"position_error_mm": {"max": 1.23456789, "rms": 0.5}}
    pretended = lambda order: Row(order.address, "success", "", result, program=program())  # noqa: E731
    monkeypatch.setattr("tcrctl.study.sweep.do", pretended)
    cases = {"as it is": {}, "another latency of the cameras": {"plant.latency_ms": 5}}
    path = study_file(tmp_path, seeds=[0, 1], cases=cases, compare={"factor": "case", "against": "as it is"})
    assert main(["sweep", str(path), "--out", "logs", "--jobs", "1", "--dry-run"]) == 0
    monkeypatch.chdir(tmp_path)
    assert main(["sweep", "quick.yaml", "--out", "logs", "--jobs", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns, lines
    assert " ".join(" ".join(lines).split()).count("1.23") >= 2
