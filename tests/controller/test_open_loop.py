"""Given drive lengths: the table, the end poses that go with it, and the controller that follows it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.drawings import Section, law, parsed
from tcrctl.config.validation import check
from tcrctl.controller.controller import build_controller
from tcrctl.controller.settings import OpenLoopSettings
from tcrctl.errors import InfeasibleError, InputError, SpecError
from tcrctl.experiment.feasibility import DriveLimits, check_drives
from tcrctl.experiment.prepare import plan, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.numerics.rotation import angle_between
from tcrctl.robot import pose
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Estimate
from tcrctl.trajectory.drives import samples, time_law
from tcrctl.trajectory.start_blend import StartBlend
from tcrctl.trajectory.trajectory import build_trajectory, sample_reference

PERIOD = 0.05
TABLE = {
    "kind": "drives",
    "legs": [
        {"drives_mm": [20, 5, 10], "duration_s": 3, "dwell_s": 1},
        {"drives_mm": [40, 30, 25], "duration_s": 2, "motion": "constant_speed"},
    ],
    "lead_in_s": 0.5,
    "settle_s": 1,
}


@pytest.fixture(scope="module")
def robot():
    return build_robot(load_robot("tcr600"))


@pytest.fixture(scope="module")
def trajectory(robot):
    return build_trajectory(parsed(TABLE), robot)


def at(*times):
    return np.array(times, dtype=float)


def test_the_table_is_passed_at_the_times_it_gives(trajectory):
    drive = 1e3 * trajectory.drive(at(-1.0, 0.5, 3.5, 4.5, 5.5, 6.5, 7.5, 99.0))
    half = [30.0, 17.5, 17.5]
    wanted = [[0, 0, 0], [0, 0, 0], [20, 5, 10], [20, 5, 10], half, *[[40, 30, 25]] * 3]
    assert np.allclose(drive, wanted, atol=1e-9)
    assert trajectory.duration == pytest.approx(7.5)


def test_smooth_legs_start_and_stop_gently_and_the_others_at_once(trajectory):
    h = 1e-3
    speed = np.diff(1e3 * trajectory.drive(np.arange(0.0, 7.5, h)), axis=0) / h
    smooth, constant = speed[500:3500], speed[4502:6498]
    assert np.abs(smooth[[0, -1]]).max() < 1e-3
    assert np.abs(np.diff(smooth, axis=0)).max() < 0.1
    assert np.allclose(constant, [10.0, 12.5, 7.5], atol=1e-6)


def test_the_wanted_pose_is_where_the_model_comes_to_rest(robot, trajectory):
    t = np.linspace(0.0, trajectory.duration, 41)
    drives, position, normal = trajectory.drive(t), trajectory.position(t), trajectory.normal(t)
    for drive, place, direction in zip(drives, position, normal, strict=True):
        shape = equilibrium(robot.model, drive, robot.weight, robot.rest.q)
        assert np.linalg.norm(pose.position(shape.q, robot.tip) - place) < 5e-5
        assert angle_between(pose.normal(shape.q, robot.tip), direction) < 1e-3
        assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(position[0], robot.rest_position, atol=1e-9)


@law
@given(st.lists(st.tuples(*[st.floats(-0.1, 0.2)] * 3), min_size=2, max_size=5))
def test_end_poses_are_computed_so_often_that_no_drive_moves_far_between_them(corners):
    table = np.array(corners)
    s = samples(table)
    assert s[0] == 0.0
    assert s[-1] == len(corners) - 1
    assert np.all(np.diff(s) > 0.0)
    assert set(range(len(corners))) <= set(s.tolist())
    drives = np.stack([np.interp(s, np.arange(len(corners)), column) for column in table.T], axis=1)
    assert np.abs(np.diff(drives, axis=0)).max() <= 2.5e-3 * (1 + 1e-9)


@law
@given(st.lists(st.tuples(st.floats(0.5, 20.0), st.floats(0.0, 3.0)), min_size=1, max_size=4))
def test_the_duration_is_that_of_all_legs_and_rests(times):
    legs = [{"drives_mm": [1, 2], "duration_s": moving, "dwell_s": dwell} for moving, dwell in times]
    section = parsed({"kind": "drives", "legs": legs, "lead_in_s": 0.25, "settle_s": 2})
    assert time_law(section).total == pytest.approx(2.25 + sum(map(sum, times)))


def estimate(drive):
    nothing = np.zeros(3)
    return Estimate(
        0.0, nothing, nothing, drive, np.full(3, 5.0), nothing, nothing, nothing, True, set_point=drive
    )


def followed(robot, trajectory, steps, **settings):
    """Drives after every step of an open-loop run with ideal drives, and whether a limit was met."""
    controller = build_controller(OpenLoopSettings(kind="open_loop", period_s=PERIOD, **settings), robot)
    drive, drives, saturated = np.zeros(3), [], []
    for k in range(steps):
        reference = sample_reference(trajectory, k * PERIOD, k * PERIOD + controller.ahead)
        command, info = controller.control(estimate(drive), reference)
        assert np.array_equal(command.drive, drive + PERIOD * command.speed)
        drive = command.drive
        drives.append(drive)
        saturated.append(info.saturated.any())
    return np.array(drives), np.array(saturated)


def test_the_drives_are_where_the_table_wants_them_at_the_end_of_every_period(robot, trajectory):
    drives, saturated = followed(robot, trajectory, 150)
    assert np.allclose(drives, trajectory.drive(PERIOD * np.arange(1, 151)), atol=1e-12)
    assert not saturated.any()


def test_drives_keep_the_speed_limit_and_catch_up_later(robot, trajectory):
    drives, saturated = followed(robot, trajectory, 150, speed_limit_mm_s=9.0)
    speed = np.diff(drives, axis=0, prepend=np.zeros((1, 3))) / PERIOD
    assert np.abs(speed).max() <= 9e-3 * (1 + 1e-9)
    assert saturated.any()
    assert not saturated[-1]
    assert np.allclose(drives[-1], [0.040, 0.030, 0.025], atol=1e-12)


def test_drives_that_lag_and_answer_late_are_not_chased(tmp_path):
    """Their set-points are those that drives without lag get; the drives come to rest with them."""
    slow = "plant.drives={lag_s: 0.1, dead_time_s: 0.05, reports: encoder}"
    told = []
    for overrides in ((), (slow,)):
        prepared = prepare(load_spec("dynamic_drive", (*overrides, "plant.step_ms=5")))
        run_experiment(prepared, out=tmp_path / str(len(told)))
        log = read_log(next((tmp_path / str(len(told))).glob("*/log.mcap")))
        told.append(log.columns(["applied_drive", "measurement_drive"]))
    assert np.abs(told[1]["applied_drive"] - told[0]["applied_drive"]).max() < 1e-9
    assert np.abs(told[1]["measurement_drive"][-1] - told[1]["applied_drive"][-1]).max() < 1e-4


def test_the_start_blend_leaves_drives_alone_that_are_where_they_should_be(robot, trajectory):
    blended = StartBlend(trajectory, robot.rest_position + 1e-3, robot.rest_normal, 2.0)
    t = np.linspace(0.0, 7.5, 20)
    assert np.array_equal(blended.drive(t), trajectory.drive(t))
    reference = sample_reference(blended, 2.0, at(2.05))
    assert np.array_equal(reference.drive, trajectory.drive(at(2.05))[0])


def test_drives_that_were_left_elsewhere_go_to_the_start_no_faster_than_they_may(robot, trajectory):
    """Not at once, in one step: that threw the robot, and its cables were told to be taut to bursting."""
    start, beside = trajectory.drive(np.zeros(1))[0], np.array([-0.011, -0.019, 0.004])
    blended = StartBlend(
        trajectory, robot.rest_position, robot.rest_normal, 1.0, speed=0.01, drive=start + beside
    )
    assert blended.approach > 1.0
    t = np.linspace(0.0, blended.approach, 2001)
    way = blended.drive(t)
    np.testing.assert_allclose(way[[0, -1]], [start + beside, start], atol=1e-12)
    speed = np.abs(np.diff(way, axis=0)).max() / (t[1] - t[0])
    assert 0.0099 < speed < 0.01 + 1e-9
    later = np.linspace(0.0, 5.0, 7)
    np.testing.assert_allclose(blended.drive(blended.approach + later), trajectory.drive(later), atol=1e-12)
    lost = StartBlend(trajectory, robot.rest_position, robot.rest_normal, 1.0, drive=np.full(3, np.nan))
    assert np.array_equal(lost.drive(later), trajectory.drive(later))


def test_trajectories_without_drives_give_none_and_the_controller_says_so(robot):
    hold = build_trajectory(parsed({"kind": "hold", "duration_s": 1}), robot)
    reference = sample_reference(StartBlend(hold, robot.rest_position, robot.rest_normal, 1.0), 0.0, at(0.05))
    assert reference.drive is None
    controller = build_controller(OpenLoopSettings(kind="open_loop"), robot)
    with pytest.raises(InputError, match=r"needs trajectory\.kind: drives"):
        controller.control(estimate(np.zeros(3)), reference)


def test_drives_beyond_the_stroke_or_too_fast_are_infeasible(robot):
    limits = DriveLimits(speed=0.05, floor=0.0, ceiling=100.0)
    fine = check_drives(build_trajectory(parsed(TABLE), robot), robot, limits)
    assert np.allclose(fine.drive[-1], [0.040, 0.030, 0.025], atol=1e-12)
    assert fine.tension.min() > 1.0
    hasty = {**TABLE, "legs": [{"drives_mm": [60, 60, 60], "duration_s": 0.5}]}
    with pytest.raises(InfeasibleError, match="speed of drive"):
        check_drives(build_trajectory(parsed(hasty), robot), robot, limits)
    far = {**TABLE, "legs": [{"drives_mm": [205, 205, 205], "duration_s": 30}]}
    with pytest.raises(InfeasibleError, match="length of drive c1"):
        check_drives(build_trajectory(parsed(far), robot), robot, limits)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"legs": []}, "at least 1 item"),
        ({"legs": [{"drives_mm": [], "duration_s": 1}]}, "at least 1 item"),
        ({"legs": [{"drives_mm": [1], "duration_s": 0}]}, "> 0"),
        (
            {"legs": [{"drives_mm": [1, 2], "duration_s": 1}, {"drives_mm": [1], "duration_s": 1}]},
            "leg 2 has 1 drives, but leg 1 has 2",
        ),
        ({"legs": [{"drives_mm": [1], "duration_s": 1, "motion": "fast"}]}, "'smooth' or 'constant_speed'"),
    ],
)
def test_tables_that_cannot_be_followed_are_refused(change, said):
    _, problems = check({**TABLE, **change}, Section)
    assert len(problems) == 1
    assert said in problems[0][1]


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (["robot=tcr600"], "tcr600 has 3 cables, c1, c2, c3; there are 6 lengths"),
        (
            ["trajectory={kind: hold, duration_s: 1}"],
            "must be drives with controller.kind: open_loop, not hold",
        ),
        (["controller.horizon_s=1"], "unknown key"),
    ],
)
def test_experiments_whose_parts_do_not_fit_are_refused(overrides, said):
    with pytest.raises(SpecError) as caught:
        load_spec("dynamic_drive", overrides)
    assert said in str(caught.value)


@pytest.mark.slow
def test_the_closed_loop_can_be_asked_for_the_pose_of_given_drives():
    weights = "{kind: ioc, output: pose, weights: {normal: 44}}"
    experiment = prepare(load_spec("table2_s_shape", [f"controller={weights}"]))
    path = plan(experiment)
    assert path.error.max() < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "drives_mm"),
    [
        ("table2_bending", [90, 50, 50, 50, 50, 50]),
        ("table2_contraction", [90, 70, 90, 70, 90, 70]),
        ("table2_s_shape", [60, 25, 55, 85, 55, 25]),
        ("dynamic_drive", [10, 20, 150, 100, 10, 20]),
    ],
)
def test_the_drives_of_the_paper_are_taken(name, drives_mm):
    path = plan(prepare(load_spec(name)))
    assert np.allclose(1e3 * path.drive[-1], drives_mm, atol=1e-9)
    assert np.abs(path.drive).max() <= np.abs(path.drive[-1]).max() + 1e-12
