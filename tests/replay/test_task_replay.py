"""Logs of experiments with a task are replayed, also with other prediction instants."""

from __future__ import annotations

import json

import pytest

from support.short_runs import BELOW
from tcrctl.cli.app import main
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec

pytestmark = pytest.mark.slow


def test_what_if_on_a_log_whose_trajectory_goes_to_a_target(tmp_path, capsys):
    summary = run_experiment(prepare(load_spec("laser_pipe", BELOW)), out=tmp_path)
    assert main(["replay", str(summary.log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "identical"
    assert main(["replay", str(summary.log), "--json", "--set", "controller.prediction.horizon_s=1.0"]) == 3
    assert json.loads(capsys.readouterr().out)["status"] == "different"
