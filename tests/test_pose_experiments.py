"""What the shipped experiments of the two-segment robot promise: times and poses of the paper."""

import math

import numpy as np
import pytest
from drawings import REST, UP, built

from tcrctl.numerics.rotation import angle_between
from tcrctl.spec import load_spec

POSES = [
    *("fixed_point_rotation", "cone_frustum", "helix", "dynamic_10s", "dynamic_45s", "dynamic_90s"),
    *("laser_pipe", "box_scan", *(f"shape_{letter}" for letter in "jsicol")),
]


def trajectory_of(name):
    return built(load_spec(name).spec.trajectory)


@pytest.mark.parametrize("name", [*POSES, "box_polyline"])
def test_each_experiment_tracks_what_its_trajectory_gives(name):
    spec = load_spec(name).spec
    trajectory = built(spec.trajectory)
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
    spec = load_spec("laser_pipe").spec
    pipes = [((0, 270, 200), (0, 1, 0)), ((115, 240, 120), (0.4330, 0.7500, -0.5000))]
    for point, (entry, axis) in zip(spec.trajectory.points, pipes, strict=True):
        assert np.allclose(np.array(entry) - 50.0 * np.array(axis), point.offset_mm, atol=0.01)
        assert np.allclose(-np.array(axis), point.normal, atol=1e-9)
        assert point.dwell_s >= 3.0


def test_the_scan_looks_along_the_x_axis_and_tilts_by_a_sixth_of_pi():
    trajectory = trajectory_of("box_scan")
    t = np.linspace(25.0, 81.0, 1000)
    off_axis = np.array(
        [angle_between(normal, np.array([-1.0, 0.0, 0.0])) for normal in trajectory.normal(t)]
    )
    assert off_axis.max() == pytest.approx(math.pi / 6.0)
    assert off_axis[[0, -1]].max() < 1e-6
    assert np.ptp(trajectory.position(t), axis=0).max() < 1e-9
    assert angle_between(trajectory.normal(np.zeros(1))[0], UP) < 1e-9
