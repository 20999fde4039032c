"""The ``task:`` section of an experiment: what is refused, and a run from the markers to the log."""

from __future__ import annotations

import json

import pytest

from support.short_runs import BELOW
from tcrctl.cli.app import main
from tcrctl.config import strict_yaml
from tcrctl.errors import SpecError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log


@pytest.mark.parametrize(
    ("name", "override", "key", "said"),
    [
        ("laser_pipe", "trajectory.points.0.target=lvl", "trajectory.points.0.target", "level, inclined"),
        ("laser_pipe", "task.pipes.1.name=level", "task.pipes.1.name", "taken already"),
        ("laser_pipe", "task.pipes.0.bore_mm=0.5", "task.pipes.0.bore_mm", "more than beam_mm"),
        ("laser_pipe", "task.pipes.0.entry_markers_mm.1=[30, 270, -453.3]", "entry_markers_mm", "marker 2"),
        (
            "laser_pipe",
            "task.pipes.0.exit_markers_mm=[[0, 0, 0], [1, 0, 0]]",
            "exit_markers_mm",
            "at least 3",
        ),
        ("laser_pipe", "trajectory.points.0.normal=[0, -1, 0]", "trajectory.points.0", "its own direction"),
        ("laser_pipe", "task.kind=laser", "task.kind", "laser_pipe"),
        ("box_scan", "trajectory.hole={target: left, axis: [1, 0, 0]}", "trajectory.hole", "exactly one"),
        ("box_scan", "trajectory.insert_s=0", "trajectory", "insert_mm"),
        ("box_scan", "task.objects.0.position_mm=[99, 0, 0]", "task.objects.0.position_mm", "not inside"),
        ("box_scan", "task.box.holes.0.diameter_mm=120", "task.box.holes.0", "left wall"),
        ("box_scan", "task.box.holes.1.wall=left", "task.box.holes.1", "overlaps the hole left"),
        (
            "box_scan",
            "task.box.markers_mm=[[175, 44, -429], [175, -44, -517], [175, -44, -429], [175, 44, -517]]",
            "task.box.markers_mm",
            "face each other",
        ),
        (
            "box_scan",
            "task.box.markers_mm=[[1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3]]",
            "markers_mm",
            "one place",
        ),
        ("box_scan", "criteria=[task.detectd == 3]", "criteria.0", "task.detected"),
        ("letter_t", "criteria=[task.detected == 3]", "criteria.0", "no result task.detected"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(name, override, key, said):
    with pytest.raises(SpecError) as caught:
        load_spec(name, (override,))
    assert any(key in problem.key and said in problem.message for problem in caught.value.problems), str(
        caught.value
    )


def test_a_target_needs_a_task(tmp_path):
    document = strict_yaml.load(load_spec("laser_pipe").path).data
    del document["task"], document["criteria"]
    path = tmp_path / "no_task.yaml"
    path.write_text(strict_yaml.dumps(document))
    with pytest.raises(
        SpecError, match=r"no_task\.yaml:\d+:\d+: trajectory.points.0.target: there is no task"
    ):
        load_spec(str(path))


@pytest.mark.slow
def test_a_run_from_markers_to_the_log(tmp_path):
    summary = run_experiment(prepare(load_spec("laser_pipe", BELOW)), out=tmp_path)
    assert (summary.status, summary.exit_code) == ("success", 0)
    (target,) = summary.task["targets"]
    assert target["beam_passes"]
    assert [verdict.unit for verdict in summary.criteria] == ["", "mm"]
    log = read_log(summary.log)
    assert json.loads(log.stop["summary"])["task"] == summary.task
    assert ["the beam goes through" in event.message for event in log.events() if event.kind == "task"] == [
        True
    ]


@pytest.mark.slow
def test_a_missed_target_fails_its_criterion_with_exit_code_3(tmp_path, capsys):
    overrides = [part for text in (*BELOW, "task.beam_mm=15.999") for part in ("--set", text)]
    assert main(["run", "laser_pipe", "--quiet", "--json", "--out", str(tmp_path), *overrides]) == 3
    printed = json.loads(capsys.readouterr().out)
    assert printed["status"] == "failed"
    assert printed["task"]["targets"][0]["beam_passes"] is False
    assert [item["passed"] for item in printed["criteria"]] == [False, True]


@pytest.mark.slow
def test_the_table_for_people_tells_what_the_task_found(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    overrides = [part for text in (*BELOW, "task.beam_mm=15.999") for part in ("--set", text)]
    assert main(["run", "laser_pipe", "--quiet", "--out", str(tmp_path), *overrides]) == 3
    printed = capsys.readouterr()
    assert "target low" in printed.out
    assert "the beam does not go through" in printed.out
    assert "task.targets.0.beam_passes is false, must be == true" in printed.err
