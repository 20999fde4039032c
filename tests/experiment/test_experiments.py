"""Every shipped experiment can be run: files, robot, trajectory and limits fit each other."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tcrctl.cli.app import main
from tcrctl.config import shipped
from tcrctl.experiment.prepare import plan, prepare
from tcrctl.experiment.spec import load_spec

NAMES = list(shipped.experiments())


def test_there_are_experiments():
    assert "letter_t" in NAMES


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_experiment_is_feasible_with_room_to_correct(name):
    experiment = prepare(load_spec(name))
    path = plan(experiment)
    controller = experiment.spec.controller
    low, high = experiment.robot.stroke
    assert experiment.steps == pytest.approx(experiment.trajectory.duration / experiment.period, abs=1.0)
    assert np.abs(path.speed).max() < 0.8e-3 * controller.speed_limit_mm_s
    assert low < path.drive.min() <= path.drive.max() < high
    assert experiment.spec.criteria


@pytest.mark.slow
def test_a_dry_run_writes_nothing_and_says_what_a_run_would_do(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "letter_t", "--dry-run", "--json"]) == 0
    printed = capsys.readouterr()
    said = json.loads(printed.out)
    assert said["status"] == "success"
    assert said["steps"] * 0.025 == pytest.approx(said["duration_s"])
    assert said["feasibility"]["tension_n"]["min"] > 1.0
    assert main(["run", "letter_t", "--dry-run"]) == 0
    assert f"{said['steps']} steps" in capsys.readouterr().out
    assert main(["run", "letter_t", "--dry-run", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []
