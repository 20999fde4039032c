"""What the shipped experiments of the two-segment robot promise: times and poses of the paper."""

from __future__ import annotations

import math

import numpy as np
import pytest

from support.drawings import REST, UP, built
from tcrctl.experiment.spec import load_spec
from tcrctl.numerics.rotation import angle_between
from tcrctl.task.task import task_targets

POSES = [
    *("fixed_point_rotation", "cone_frustum", "helix", "dynamic_10s", "dynamic_45s", "dynamic_90s"),
    *("laser_pipe", "box_scan", *(f"shape_{letter}" for letter in "jsicol")),
]


def trajectory_of(name):
    spec = load_spec(name).spec
    return built(spec.trajectory, task_targets(spec.task, spec.seed) if spec.task else {})


@pytest.mark.parametrize("name", [*POSES, "box_polyline"])
def test_each_experiment_tracks_what_its_trajectory_gives(name):
    spec = load_spec(name).spec
    trajectory = trajectory_of(name)
    oriented = trajectory.normal(np.zeros(1)) is not None
    assert oriented == (spec.controller.output == "pose") == (name in POSES)
    assert spec.robot == "tcr700"
    assert np.allclose(trajectory.position(np.zeros(1)), REST, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "total_s"), [("dynamic_10s", 10), ("dynamic_45s", 45), ("dynamic_90s", 90), ("box_scan", 84)]
)
def test_experiments_take_the_total_times_of_the_paper(name, total_s):
    assert trajectory_of(name).duration == pytest.approx(total_s)


def test_the_dynamic_experiments_are_one_motion_at_three_speeds():
    fast, middle, slow = (trajectory_of(f"dynamic_{total}s") for total in (10, 45, 90))
    t = np.linspace(0.0, 10.0, 200)
    assert np.allclose(fast.normal(t), slow.normal(9.0 * t), atol=1e-12)
    assert np.allclose(fast.normal(t), middle.normal(4.5 * t), atol=1e-12)
    assert np.allclose(fast.position(t), REST, atol=1e-12)


def test_the_end_turns_about_a_fixed_point_with_its_axis_at_55_degrees_to_the_horizontal():
    trajectory = trajectory_of("fixed_point_rotation")
    turning = np.linspace(12.0, 12.0 + 2 * 20.0 + 4.0, 1000)
    normal = trajectory.normal(turning)
    assert np.allclose(np.degrees(np.arcsin(normal[:, 2])), 55.0, atol=1e-9)
    assert np.ptp(trajectory.position(turning), axis=0).max() < 1e-12
    azimuth = np.unwrap(np.arctan2(normal[:, 1], normal[:, 0]))
    assert azimuth[-1] - azimuth[0] == pytest.approx(4.0 * math.pi)


def test_cone_frustum_and_helix_wind_twice_about_a_vertical_axis():
    for name, narrows in (("cone_frustum", True), ("helix", False)):
        trajectory = trajectory_of(name)
        t = np.linspace(12.0, 12.0 + 54.0, 1000)
        spoke = (trajectory.position(t) - REST)[:, :2]
        angle, radius = np.unwrap(np.arctan2(spoke[:, 1], spoke[:, 0])), np.linalg.norm(spoke, axis=1)
        assert angle[-1] - angle[0] == pytest.approx(4.0 * math.pi, rel=1e-6)
        assert (np.ptp(radius) > 0.02) == narrows
        assert np.ptp(trajectory.position(t)[:, 2]) > 0.02


def test_the_laser_stops_50_mm_before_the_entry_of_each_pipe_on_its_axis():
    spec, trajectory = load_spec("laser_pipe").spec, trajectory_of("laser_pipe")
    t = np.arange(0.0, trajectory.duration, 0.05)
    position, normal = 1e3 * trajectory.position(t), trajectory.normal(t)
    for pipe, axis in zip(spec.task.pipes, ((0, 1, 0), (0.4330, 0.7500, -0.5000)), strict=True):
        stop = np.mean(pipe.entry_markers_mm, axis=0) - 50.0 * np.array(axis)
        there = np.linalg.norm(position - stop, axis=1) < 0.2  # four sigma of 50 um, four times
        assert 5.0 <= 0.05 * np.count_nonzero(there) < 8.0
        assert np.allclose(normal[there], -np.array(axis), atol=2e-3)
        assert np.linalg.norm(position - stop, axis=1).min() > 0.0  # the markers are seen with noise


def test_the_scan_goes_into_the_hole_along_its_axis():
    trajectory = trajectory_of("box_scan")
    t = np.linspace(19.0, 25.0, 200)
    position, normal = 1e3 * trajectory.position(t), trajectory.normal(t)
    assert position[-1, 0] - position[0, 0] == pytest.approx(40.0, abs=0.1)
    assert np.ptp(position[:, 1:], axis=0).max() < 0.2
    assert np.allclose(normal, [-1.0, 0.0, 0.0], atol=2e-3)


def test_the_scan_looks_along_the_x_axis_and_tilts_by_a_sixth_of_pi():
    trajectory = trajectory_of("box_scan")
    t = np.linspace(25.0, 81.0, 1000)
    axis = trajectory.normal(np.array([24.9999, 25.0]))[-1]
    assert angle_between(axis, np.array([-1.0, 0.0, 0.0])) < 2e-3  # as far as noisy markers tell
    off_axis = np.array([angle_between(normal, axis) for normal in trajectory.normal(t)])
    assert off_axis.max() == pytest.approx(math.pi / 6.0)
    assert off_axis[[0, -1]].max() < 1e-6
    assert np.ptp(trajectory.position(t), axis=0).max() < 1e-9
    assert angle_between(trajectory.normal(np.zeros(1))[0], UP) < 1e-9
