"""Trajectories that cannot be followed: refused with time and reason, or forced and kept within limits."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from tcrctl.cli.app import main
from tcrctl.log.reader import read_log

NO_TASK = ("task=null", "criteria=[]")
OUT_OF_REACH = (*NO_TASK, "trajectory.points=[{offset_mm: [450, 0, 100], normal: [0, 0, 1]}]")
UNDER_THE_FLOOR = (*NO_TASK, "trajectory.points=[{offset_mm: [0, 0, -150], normal: [0, 0, 1]}]")
TOO_FAST = (
    "trajectory.turns=1",
    "trajectory.dwell_s=0",
    "trajectory.blend_out_s=0",
    "trajectory.turn_s=2",
    "trajectory.ramp_s=1",
    "trajectory.blend_in_s=2",
    "criteria=[]",
)


def run(name, overrides, tmp_path, capsys, *options):
    arguments = [part for text in overrides for part in ("--set", text)]
    code = main(["run", name, "--quiet", "--json", "--out", str(tmp_path / "runs"), *arguments, *options])
    printed = capsys.readouterr()
    return code, json.loads(printed.out), printed.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides", "reason"),
    [
        ("laser_pipe", OUT_OF_REACH, r"tension of cable c\d is 0\.\d+ N, limit 1 N"),
        ("laser_pipe", UNDER_THE_FLOOR, r"(tension of cable|error of the end pose)"),
        ("fixed_point_rotation", TOO_FAST, r"speed of drive c\d is \d\d\.\d+ mm/s, limit 50 mm/s"),
    ],
)
def test_it_is_refused_with_the_first_time_and_the_reason(name, overrides, reason, tmp_path, capsys):
    code, printed, said = run(name, overrides, tmp_path, capsys)
    assert code == 2
    assert re.search(r"infeasible at t = \d+\.\d{3} s: " + reason, printed["reason"])
    assert "--force" in said
    assert not (tmp_path / "runs").exists()


def within_limits(log):
    steps = list(log.steps())
    speed = np.array([step.applied.speed for step in steps])
    drive = np.array([step.applied.drive for step in steps])
    assert np.abs(speed).max() <= 0.05 + 1e-12
    assert -0.1 <= drive.min() <= drive.max() <= 0.2  # the robot's stroke
    return np.abs(speed).max()


@pytest.mark.slow
def test_forced_out_of_reach_it_stops_with_exit_code_4_and_a_complete_log(tmp_path, capsys):
    code, printed, _ = run("laser_pipe", OUT_OF_REACH, tmp_path, capsys, "--force")
    assert (code, printed["status"]) == (4, "aborted")
    assert "position error" in printed["reason"]
    log = read_log(printed["log"])
    assert log.complete
    within_limits(log)


@pytest.mark.slow
def test_forced_too_fast_it_saturates_and_goes_on(tmp_path, capsys):
    code, printed, _ = run("fixed_point_rotation", TOO_FAST, tmp_path, capsys, "--force")
    assert (code, printed["status"]) == (0, "success")
    assert printed["saturated_fraction"] > 0.05
    assert printed["orientation_error_deg"]["max"] > 2.0
    assert within_limits(read_log(printed["log"])) == pytest.approx(0.05)
