"""The comparison with the paper: rows as data, jobs side by side, verdicts, and what is kept when it is stopped."""

from __future__ import annotations

import json
import os
import signal
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.engines import stay_here
from support.jobs import Killed, Marked, Patient, Result
from support.short_runs import short_spec
from support.studies import study_file
from tcrctl.cli.app import main
from tcrctl.errors import RunInterruptedError, UnknownNameError
from tcrctl.executors.engine import Engine
from tcrctl.experiment.spec import load_spec
from tcrctl.paper import job as paper_job
from tcrctl.paper import paper, report
from tcrctl.paper.checks import CHECKS
from tcrctl.paper.job import Check, Done, Run, do
from tcrctl.paper.over_seeds import experiments_of, over_seeds
from tcrctl.paper.paper import choose, jobs_of, run_jobs, run_paper
from tcrctl.paper.report import TITLES, cells, make_line, markdown, titles
from tcrctl.paper.row import Row, found, total, worst
from tcrctl.paper.table import ROWS
from tcrctl.paper.table2 import CONFIGURATIONS, measured_displacements, model_displacements
from tcrctl.study.design import Cell
from tcrctl.study.loading import load_study
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row as StudyRow
from tcrctl.study.sweep import Done as StudyDone


def nothing(item):
    del item


def collected(jobs, folder, workers=2):
    return {item.job: item for item in run_jobs(jobs, folder, Engine(workers), nothing)}


def row(job, must=1.0, goal=0.1, **changes):
    return Row("r", "work", "2.3", "mm", must, goal, (job,), worst("x"), **changes)


def test_every_row_has_its_own_name_and_jobs_that_exist():
    names = [row.name for row in ROWS]
    assert len(set(names)) == len(names)
    for job in jobs_of(ROWS):
        if isinstance(job, Run):
            assert load_spec(job.experiment, job.overrides).spec.criteria
        else:
            assert isinstance(job, Check)
            assert job.name in CHECKS


def test_runs_whose_time_counts_have_the_machine_for_themselves():
    timed = [row for row in ROWS if row.unit == "workload"]
    assert len(timed) == 3
    assert all(job.alone for row in timed for job in row.jobs)


def test_a_job_that_several_rows_need_runs_once():
    assert len(jobs_of(choose(["fixed_point", "fixed_point_theta"]))) == 1


def test_an_unknown_row_is_refused_with_those_there_are():
    with pytest.raises(UnknownNameError, match="laser_pipe") as caught:
        choose(["laser_pip"])
    assert "laser_pipe" in caught.value.hint


@given(st.floats(0, 10), st.floats(0, 10), st.floats(0, 10), st.booleans())
def test_a_better_value_never_gets_a_worse_verdict(value, other, span, at_least):
    must, goal = (5.0, 5.0 + span) if at_least else (5.0, 5.0 - span)
    judged = row(Result("a"), must, goal, at_least=at_least)
    ranks = {"missed": 0, "met": 1, "goal": 2}
    better, worse = (max, min) if at_least else (min, max)
    good, bad = better(value, other), worse(value, other)
    assert ranks[judged.verdict(good)] >= ranks[judged.verdict(bad)]
    assert (judged.verdict(value) == "missed") == (value < must if at_least else value > must)


def test_without_a_bar_nothing_is_missed_and_without_a_value_it_is_a_failure():
    assert row(Result("a"), None, None).verdict(99.0) == "shown"
    assert row(Result("a"), None, 1.0).verdict(99.0) == "shown"
    assert row(Result("a"), None, 1.0).verdict(0.5) == "goal"
    assert row(Result("a")).verdict(None) == "failed"


def test_values_are_found_through_maps_and_lists():
    result = {"task": {"targets": [{"e": 1.0, "ok": True}, {"e": 3.0, "ok": False}]}, "p": {"max": 2.0}}
    assert found(result, "task.targets.e") == [1.0, 3.0]
    assert worst("task.targets.e", "p.max")([result, {"task": {"targets": []}, "p": {"max": 4.0}}]) == 4.0
    assert total("task.targets.ok")([result]) == 1.0
    assert worst("p.min")([result]) is None
    assert worst("p.max")([result, {"p": None}]) is None


@pytest.mark.slow
def test_jobs_run_side_by_side_and_those_alone_one_by_one_after_them(tmp_path):
    jobs = [Marked("a", alone=True), Marked("b", alone=True), Marked("c", "d"), Marked("d", "c")]
    seen = {job.label: item.result["x"] for job, item in collected(jobs, tmp_path).items()}
    stay = ["c", "d"]  # the marks of partners
    assert seen == {"a": ["a", *stay], "b": ["b", *stay], "c": stay, "d": stay}


@pytest.mark.parametrize(
    ("job", "reason"),
    [
        (Result("a", (("reason", "diverged"),), 4), "diverged"),
        (Result("a", error="no such robot"), "no such robot"),
        (Result("a"), "exit code 0"),
    ],
)
def test_a_failed_job_is_a_row_with_its_reason(job, reason, tmp_path, monkeypatch):
    stay_here(monkeypatch)
    check_failed(job, reason, tmp_path)


@pytest.mark.slow
def test_a_job_that_ends_its_process_is_a_row_with_its_reason(tmp_path):
    check_failed(Killed("a"), "its process ended by itself", tmp_path)


def check_failed(job, reason, tmp_path):
    line = make_line(row(job), collected([job], tmp_path))
    assert (line.verdict, line.value) == ("failed", None)
    assert line.reason.startswith("a: ")
    assert reason in line.reason


def test_that_a_run_was_stopped_is_a_result_where_the_row_says_so(tmp_path):
    job = Result("a", (("x", 70.0), ("reason", "diverged")), 4)
    done = {job: do((job, tmp_path))}
    may = make_line(row(job, None, None, text=lambda results: "diverges", may_stop=True), done)
    assert (may.verdict, may.value, may.measured, may.reason) == ("shown", 70.0, "diverges", "")
    assert make_line(row(job, None, None), done).verdict == "failed"


def test_a_run_that_misses_its_own_criterion_is_still_measured(tmp_path):
    job = Result("a", (("x", 0.5), ("log", "l.mcap")), 3)
    line = make_line(row(job), {job: do((job, tmp_path))})
    assert (line.verdict, line.value, line.logs) == ("met", 0.5, ("l.mcap",))


def test_the_markdown_table_has_a_cell_for_every_title():
    job = Result("a")
    lines = [
        make_line(row(job), {job: Done(job, {"x": 0.5}, "", 1.0)}),
        make_line(row(job), {job: Done(job, {}, "a | b\nc", 1.0)}),
        make_line(row(job), {}),
    ]
    table = markdown(lines, ["Note."]).splitlines()
    assert [line.replace("\\|", "").count("|") for line in table[:5]] == [len(TITLES) + 1] * 5
    assert "| work [mm] | 2.3 | 1 | 0.1 | 0.5 | met |" in table
    assert lines[2].verdict == "not run"


@pytest.mark.slow
def test_ctrl_c_stops_the_jobs_and_keeps_what_is_done(tmp_path):
    quick, slow = Result("quick", (("x", 0.05),)), Patient("slow", alone=True)

    def press():
        patience = time.monotonic() + 60.0
        while not list(tmp_path.glob("*/running")) and time.monotonic() < patience:
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press).start()
    report = run_paper([row(quick), row(slow)], out=tmp_path, engine=Engine(2), begun=nothing, ended=nothing)
    assert (report.exit_code, report.as_json()["status"]) == (130, "aborted")
    assert isinstance(report.interruption, RunInterruptedError)
    assert [line.verdict for line in report.lines] == ["goal", "not run"]
    assert (report.folder / "safe").exists()  # it was asked to stop, and could
    assert json.loads((report.folder / "paper.json").read_text())["rows"][0]["measured"] == 0.05


@pytest.mark.slow
def test_the_command_prints_one_object_and_exits_with_3_if_a_bar_is_missed(tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    jobs = [Result("good", (("x", 0.5),)), Result("bad", (("x", 1.5),)), Result("ugly", code=1)]
    rows = tuple(
        Row(job.label, "work", "2.3", "mm", 1.0, 0.1, (job,), worst("x"), False, None) for job in jobs
    )
    monkeypatch.setattr(paper, "ROWS", rows)
    assert main(["paper", "--json", "--out", str(tmp_path)]) == 3
    printed = capsys.readouterr()
    made = json.loads(printed.out)
    assert {item["name"]: item["verdict"] for item in made["rows"]} == {
        "good": "met",
        "bad": "missed",
        "ugly": "failed",
    }
    assert made["reason"] == "missed: bad, ugly"
    assert printed.err.count("[") == 3
    assert main(["paper", "--only", "good", "--quiet", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["paper", "--only", "good", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr()
    assert "1 of 1 bars met" in printed.out
    folders = list(tmp_path.iterdir())
    assert len(folders) == 3
    assert all({"paper.md", "paper.json"} <= {p.name for p in folder.iterdir()} for folder in folders)


def plants(**by_name):
    """A study with the largest errors of some experiments, plant by plant; None: stopped."""
    runs, rows = [], []
    for name, errors in by_name.items():
        for seed, error in enumerate(errors, start=1):
            address = f"{name}{seed}"
            runs.append(PlannedRun(address, {"experiment": name}, seed, Cell(name, None, {})))
            result = {"position_error_mm": {"max": error}}
            rows.append(StudyRow(address, *(("success", "", result) if error else ("aborted", "diverged"))))
    return StudyDone(tuple(runs), tuple(rows), 0, 1.0, 0, None)


def test_a_row_over_plants_takes_the_worst_of_its_runs_on_each_and_counts_who_was_stopped():
    letters = Row(
        "l", "letters", "6.3", "mm", 3.0, 0.5, (Run("heart"), Run("letter_t")), worst("position_error_mm.max")
    )
    found = over_seeds(letters, plants(heart=[1.0, 5.0, 2.0, None], letter_t=[3.0, 1.0, 2.0, 1.0]))
    assert (found.spread.n, found.spread.median, found.spread.worst) == (4, 4.0, float("inf"))
    assert (found.stopped.count, found.as_json()["worst"]) == (1, None)
    assert over_seeds(letters, plants(heart=[1.0])) is None


def test_only_shipped_experiments_are_run_on_other_plants_and_never_for_their_time():
    measured = {row.name for row in ROWS if experiments_of(row)}
    assert {"letters", "helix", "laser_beam", "box_scan", "dynamic_10s"} <= measured
    assert measured.isdisjoint({"letters_perfect", "static_10s", "table2", "control_p50", "kinematic"})
    known = load_study("realistic").spec.experiments
    assert {name for row in ROWS if row.must is not None for name in experiments_of(row)} <= {*known}


def test_the_columns_of_many_plants_are_there_only_if_they_were_asked():
    job = Result("a")
    line = make_line(row(job), {job: Done(job, {"x": 0.5}, "", 1.0)})
    letter = Row("t", "T", "6.3", "mm", 3.0, 0.5, (Run("letter_t"),), worst("position_error_mm.max"))
    more = line.over("realistic", over_seeds(letter, plants(letter_t=[1.0, 2.0, 3.0])))
    both = more.over("calibrated", over_seeds(letter, plants(letter_t=[0.5, 0.6, 0.55])))
    assert titles([line]) == TITLES
    assert len(titles([line, more])) == len(TITLES) + 6
    assert {len(texts) for texts in cells([line, more])} == {len(TITLES) + 6}
    assert "| 2 [1, 3] | 3 | 0 of 3 |  |  |  |" in markdown([line, more], [])
    assert "| 2 [1, 3] | 3 | 0 of 3 | 0.55 [0.5, 0.6] | 0.6 | 0 of 3 |" in markdown([line, both], [])


def test_the_displacements_of_table_2_keep_their_lengths_in_the_robots_frame(tcr700):
    measured = measured_displacements()
    lengths = [133.1, 91.0, 229.0]  # the table's relative errors are parts of these, [TCR, Table II]
    relative = [7.57 / 0.0568, 5.99 / 0.0658, 9.75 / 0.0426]
    assert [1e3 * np.linalg.norm(measured[name]) for name in CONFIGURATIONS] == pytest.approx(
        lengths, abs=0.5
    )
    assert relative == pytest.approx(lengths, rel=0.005)
    model = model_displacements(tcr700)
    assert np.linalg.norm(model["contraction"][:2]) < 2e-3  # symmetric drives bend nothing
    assert all(model[name][2] > 0.0 for name in CONFIGURATIONS)  # pulling shortens


@pytest.mark.slow
def test_a_real_row_from_the_command_to_the_number(tmp_path, capsys):
    assert main(["paper", "--only", "table2", "--json", "--quiet", "--out", str(tmp_path)]) == 0
    (line,) = json.loads(capsys.readouterr().out)["rows"]
    assert line["verdict"] == "met"
    assert line["measured"] == pytest.approx(6.80, abs=0.02)


@pytest.mark.slow
def test_the_command_runs_rows_on_other_plants_and_keeps_them_in_the_study(tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    monkeypatch.setattr(paper_job, "load_spec", lambda name, overrides: short_spec("plant.step_ms=10"))
    letter = Row("t", "T", "6.3", "mm", 3.0, 0.5, (Run("letter_t"),), worst("position_error_mm.max"))
    monkeypatch.setattr(paper, "ROWS", (letter,))
    short = str(study_file(tmp_path))
    monkeypatch.setattr(paper, "STUDIES", (short,))  # of short runs too
    monkeypatch.setattr(report, "STUDIES", (short, "calibrated"))
    order = ["paper", "--seeds", "3", "--jobs", "1", "--json", "--quiet", "--out", str(tmp_path)]
    assert main(order) == 0
    (line,) = json.loads(capsys.readouterr().out)["rows"]
    plants = line["on_moderate_plants"]
    assert (plants["n"], plants["stopped"]) == (3, 0)
    assert plants["low"] <= plants["median"] <= plants["high"] <= plants["worst"]
    rows = (tmp_path / "quick.study" / "rows.jsonl").read_bytes().splitlines()
    assert len(rows) == 3
