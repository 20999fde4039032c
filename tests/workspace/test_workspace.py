"""Every point of a workspace is an equilibrium within all limits; what lies beyond the end of a ray is not."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from support.engines import stay_here
from tcrctl.cli.app import main
from tcrctl.errors import NoEquilibriumError
from tcrctl.executors.engine import Engine
from tcrctl.robot import pose
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.workspace.ray import Limits, follow
from tcrctl.workspace.workspace import directions, explore

LIMITS = Limits(floor=0.5, ceiling=100.0, spacing=8e-3)


@pytest.mark.parametrize("i", range(4))
def test_points_of_a_ray_are_equilibria_within_the_limits_and_the_next_one_is_none(tcr5x4, i):
    robot, direction = tcr5x4, directions(4, 4)[i]
    ray = follow(robot, direction, LIMITS)
    steps = np.outer(np.arange(len(ray.drive)), LIMITS.spacing * direction / np.abs(direction).max())
    np.testing.assert_allclose(ray.drive, steps, atol=1e-12)
    assert np.all((robot.stroke[0] <= ray.drive) & (ray.drive <= robot.stroke[1]))
    assert ray.tension[1:].min(initial=np.inf) >= LIMITS.floor
    held = equilibrium(robot.model, ray.drive[-1], robot.weight, robot.rest.q)
    np.testing.assert_allclose(pose.position(held.q, robot.tip), ray.position[-1], atol=1e-5)
    beyond = ray.drive[-1] + LIMITS.spacing * direction / np.abs(direction).max()
    if ray.end == "stroke":
        assert np.any((beyond < robot.stroke[0]) | (beyond > robot.stroke[1]))
    elif ray.end == "slack":
        last = equilibrium(robot.model, beyond, robot.weight, held.q, ray.drive[-1])
        assert last.tension.min() < LIMITS.floor
    else:
        assert ray.end == "no equilibrium"
        with pytest.raises(NoEquilibriumError):
            equilibrium(robot.model, beyond, robot.weight, held.q, ray.drive[-1])


def test_pulling_all_cables_alike_lifts_the_end_straight_up(tcr5x4):
    ray = follow(tcr5x4, np.ones(4), LIMITS)
    lifted = ray.position - ray.position[0]
    assert np.all(np.diff(lifted[:, 2]) > 0.0)
    assert np.abs(lifted[:, :2]).max() < 1e-6
    np.testing.assert_allclose(ray.normal[:, 2], 1.0, atol=1e-9)


def test_a_turn_of_a_symmetric_robot_turns_its_workspace(tcr5x4):
    """Four cables at 0, 90, 180, 270 deg, three rods at 120 deg: only a mirror is left, at the x axis."""
    angles = np.radians([0.0, 90.0, 180.0, 270.0])
    one = follow(tcr5x4, np.cos(angles - 0.7), LIMITS)
    other = follow(tcr5x4, np.cos(angles + 0.7), LIMITS)
    assert one.end == other.end
    np.testing.assert_allclose(one.position * (1.0, -1.0, 1.0), other.position, atol=1e-6)


def test_more_rays_reach_no_less_and_directions_are_the_same_every_time():
    assert np.array_equal(directions(8, 6), directions(16, 6)[:8])
    spread = directions(256, 6)
    assert np.abs(spread.mean(axis=0)).max() < 0.05
    assert np.abs(np.corrcoef(spread.T) - np.eye(6)).max() < 0.1


@pytest.mark.slow
def test_the_workspace_is_the_same_however_many_processes_follow_it(tmp_path, capsys, monkeypatch):
    robot = load_robot("tcr5x4")
    two = explore(robot, 6, LIMITS, Engine(2), lambda done, total: None)
    stay_here(monkeypatch)
    one = explore(robot, 6, LIMITS, Engine(1), lambda done, total: None)
    assert np.array_equal(one.offset, two.offset)
    order = ["workspace", "tcr5x4", "--rays", "6", "--spacing-mm", "8", "--jobs", "1", "--out", str(tmp_path)]
    assert main([*order, "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["points"] == len(one.tilt)
    assert sum(made["ray_ends"].values()) == 6
    (folder,) = tmp_path.iterdir()
    with open(folder / "workspace.csv") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == made["points"]
    np.testing.assert_allclose(
        [float(line["z_mm"]) for line in lines], 1e3 * one.offset[:, 2], rtol=1e-5, atol=1e-3
    )
    cloud = (folder / "workspace.ply").read_text().splitlines()
    assert len(cloud) == cloud.index("end_header") + 1 + made["points"]
    assert (folder / "workspace.png").stat().st_size > 1000
    assert made["radius_mm"]["max"] == pytest.approx(max(band["radius_mm"] for band in made["bands"]))
