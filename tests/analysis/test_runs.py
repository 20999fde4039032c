"""Runs are found by what they are and what came out; conditions mean what they say."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.analysis.condition import parse_condition
from tcrctl.analysis.runs import find_runs, in_order
from tcrctl.cli.app import main
from tcrctl.errors import InputError

NUMBERS = st.floats(-1e6, 1e6)


@pytest.mark.slow
@given(NUMBERS, NUMBERS)
def test_a_comparison_is_that_of_the_numbers(a, b):
    expected = {"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b, "=": a == b, "==": a == b, "!=": a != b}
    for relation, truth in expected.items():
        assert parse_condition(f"x.y{relation}{b!r}").holds({"x.y": a}.get) == truth


@given(st.lists(st.booleans(), min_size=1, max_size=5))
def test_and_needs_all(flags):
    text = " and ".join(f"x{i}=true" for i in range(len(flags)))
    assert parse_condition(text).holds({f"x{i}": flag for i, flag in enumerate(flags)}.get) == all(flags)


def test_text_and_numbers_have_no_order_and_what_is_missing_is_only_unequal():
    for text in ("x<1", "x>1", "x=1", "x<=a"):
        assert not parse_condition(text).holds({}.get)
    assert parse_condition("x!=1").holds({}.get)
    assert not parse_condition("x<1").holds({"x": "0"}.get)
    assert not parse_condition("x=1").holds({"x": True}.get)
    assert parse_condition("x='a b' and y != ioc").holds({"x": "a b", "y": "kinematic"}.get)


@pytest.mark.parametrize("text", ["", "x", "x=", "=1", "x=1 and", "1<x"])
def test_what_is_no_condition_is_refused(text):
    with pytest.raises(InputError, match="is no comparison"):
        parse_condition(text)


@pytest.fixture
def logs(tmp_path):
    """Three runs, a folder of something else, and one that has no result yet."""
    for i, (kind, error) in enumerate([("ioc", 0.5), ("ioc", 3.0), ("kinematic", None)]):
        folder = tmp_path / f"2026_{i}_letter"
        folder.mkdir()
        measured = None if error is None else {"max": error}
        summary = {"run_id": folder.name, "status": "success", "seed": i, "position_error_mm": measured}
        (folder / "summary.json").write_text(json.dumps(summary))
        (folder / "spec.resolved.yaml").write_text(f"controller: {{kind: {kind}}}\n")
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "summary.json").write_text("{}")
    (tmp_path / "latest").symlink_to("2026_2_letter")
    return tmp_path


def listed(capsys, *arguments):
    assert main(["runs", *map(str, arguments), "--json"]) == 0
    return [run["seed"] for run in json.loads(capsys.readouterr().out)["runs"]]


def test_runs_are_listed_once_filtered_by_results_and_settings_and_sorted(logs, capsys):
    assert listed(capsys, logs) == [0, 1, 2]
    assert listed(capsys, logs, "--where", "controller.kind=ioc and position_error_mm.max<1") == [0]
    assert listed(capsys, logs, "--sort", "-position_error_mm.max") == [1, 0, 2]
    assert [run.value("seed") for run in in_order(find_runs(logs), "controller.kind")] == [0, 1, 2]
    assert listed(capsys, logs, "--last", "1") == [2]


def test_tags_stay_with_the_run_and_can_be_asked_for(logs, capsys):
    assert main(["runs", str(logs), "--where", "seed=1", "--tag", "best", "--tag", "fig-3"]) == 0
    assert main(["runs", str(logs), "--where", "seed=1", "--untag", "fig-3"]) == 0
    capsys.readouterr()
    assert listed(capsys, logs, "--where", "tag=best") == [1]


def test_a_folder_without_runs_says_so(logs, capsys):
    assert main(["runs", str(logs / "unfinished")]) == 0
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err == f"no run in {logs / 'unfinished'}\n"
    assert main(["runs", str(logs), "--where", "seed>7"]) == 0
    assert capsys.readouterr().err == f"no run in {logs} with seed>7\n"


def test_nothing_is_removed_without_yes(logs, capsys):
    assert main(["runs", str(logs), "--where", "seed>0", "--rm"]) == 0
    printed = capsys.readouterr()
    assert len(printed.out.split()) == 2
    assert "would be removed" in printed.err
    assert listed(capsys, logs) == [0, 1, 2]
    assert main(["runs", str(logs), "--where", "seed>0", "--rm", "--yes"]) == 0
    capsys.readouterr()
    assert listed(capsys, logs) == [0]


def test_columns_are_results_or_settings_in_every_format(logs, capsys, monkeypatch):
    monkeypatch.setenv("TCRCTL_LOGS", str(logs))
    assert main(["runs", "--columns", "seed,controller.kind,position_error_mm.max", "--format", "csv"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "seed,controller.kind,position_error_mm.max",
        "0,ioc,0.5",
        "1,ioc,3",
        "2,kinematic,-",
    ]
    assert main(["runs", str(logs / "nowhere")]) == 2


#: What stands in a summary.json that no run wrote.
UNREADABLE = {
    "list": "[]",
    "number": "3",
    "empty": "",
    "cut": '{"run_id": "a", ',
    "no text": b"\xff\xfe",
    "deep": '{"a":' * 20_000 + "1" + "}" * 20_000,
    "large": json.dumps({"run_id": "x" * 3_000_000}),
}


def test_results_that_cannot_be_read_are_left_out_and_named(logs, capsys):
    for name, content in UNREADABLE.items():
        (logs / name).mkdir()
        (logs / name / "summary.json").write_bytes(
            content if isinstance(content, bytes) else content.encode()
        )
    assert main(["runs", str(logs), "--json"]) == 0
    printed = capsys.readouterr()
    assert [run["seed"] for run in json.loads(printed.out)["runs"]] == [0, 1, 2]
    assert printed.err.startswith("warning: left out, summary.json cannot be read: ")
    assert f"{logs / 'cut'}, {logs / 'deep'}, {logs / 'empty'} and 4 more\n" in printed.err
    assert "paper" not in printed.err  # of something else, and whole


def refuse(word):
    raise AssertionError(f"{word} is no JSON")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-1e999", "9" * 400])
def test_numbers_that_json_has_no_word_for_are_none(logs, capsys, number):
    (logs / "odd").mkdir()
    given = f'{{"run_id": "odd", "seed": 7, "steps": {number}, "position_error_mm": {{"max": {number}}}}}'
    (logs / "odd" / "summary.json").write_text(given)
    assert main(["runs", str(logs), "--sort", "steps", "--json"]) == 0
    found = json.loads(capsys.readouterr().out, parse_constant=refuse)["runs"]
    assert [run["steps"] for run in found if run["seed"] == 7] == [None]
    assert listed(capsys, logs, "--where", "position_error_mm.max>0") == [0, 1]
    assert main(["runs", str(logs), "--columns", "steps,position_error_mm.max"]) == 0


def test_a_row_in_markdown_is_one_line_whatever_a_result_says(logs, capsys):
    (logs / "odd").mkdir()
    reason = "two\r\nlines | and \x1b[31ma bar"
    (logs / "odd" / "summary.json").write_text(json.dumps({"run_id": "odd", "reason": reason}))
    shown = ["--columns", "run_id,reason", "--format", "markdown"]
    assert main(["runs", str(logs), "--where", "run_id=odd", *shown]) == 0
    (row,) = capsys.readouterr().out.splitlines()[2:]
    assert row.startswith("| odd | two")
    assert row.count("|") - row.count("\\|") == 3
    assert row.isprintable()
