"""Quasi-static inverse along trajectories, judged by the equilibrium of the drives it finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tcrctl.errors import InfeasibleError
from tcrctl.experiment.feasibility import INTERVAL, DriveLimits, check_feasibility
from tcrctl.numerics.rotation import angle_between, normal_from_angles
from tcrctl.robot import pose
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import build_robot

LIMITS = DriveLimits(speed=0.05, floor=1.0, ceiling=60.0)


@pytest.fixture(scope="module")
def robot():
    return build_robot(load_robot("tcr600"))


@pytest.fixture(scope="module")
def long_robot():
    return build_robot(load_robot("tcr700"))


class Circle:
    """Rises and widens to a circle within 4 s; its normal tilts with it, or is free."""

    def __init__(self, robot, radius, rise=0.0, tilt_deg=None, duration=12.0, turn=10.0):
        self.robot, self.radius, self.rise, self.tilt = robot, radius, rise, tilt_deg
        self.duration, self.rate = duration, 2.0 * np.pi / turn

    def _widening(self, t):
        x = np.clip(t / 4.0, 0.0, 1.0)
        return x**2 * (3.0 - 2.0 * x)

    def position(self, t):
        a, angle = self._widening(t), self.rate * t
        offset = [a * self.radius * np.cos(angle), a * self.radius * np.sin(angle), a * self.rise]
        return self.robot.rest_position + np.stack(offset, axis=1)

    def normal(self, t):
        if self.tilt is None:
            return None
        tilt, angle = np.radians(self.tilt) * self._widening(t), self.rate * t
        return np.array(
            [normal_from_angles(*x) for x in zip(-tilt * np.sin(angle), tilt * np.cos(angle), strict=True)]
        )


def checked(trajectory, robot, path):
    """Largest errors of position [m] and normal [rad] with the drives found, from the rest shape anew."""
    position, normal = trajectory.position(path.time), trajectory.normal(path.time)
    off, turned = 0.0, 0.0
    for i in range(0, path.time.size, 5):
        shape = equilibrium(robot.model, path.drive[i], robot.weight, robot.rest.q)
        off = max(off, np.linalg.norm(pose.position(shape.q, robot.tip) - position[i]))
        if normal is not None:
            turned = max(turned, angle_between(pose.normal(shape.q, robot.tip), normal[i]))
        np.testing.assert_allclose(path.tension[i], shape.tension, atol=1e-6)
    return off, turned


@pytest.mark.parametrize(("radius", "rise"), [(0.03, 0.04), (0.05, 0.05), (0.01, 0.0)])
def test_the_drives_found_hold_the_end_where_it_is_wanted(robot, radius, rise):
    trajectory = Circle(robot, radius, rise)
    path = check_feasibility(trajectory, robot, LIMITS)
    off, _ = checked(trajectory, robot, path)
    assert off < 5e-5
    assert np.diff(path.time).max() <= INTERVAL * (1.0 + 1e-12)
    assert (path.time[0], path.time[-1]) == (0.0, trajectory.duration)


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 20.0, 35.0])
def test_a_pose_is_held_and_no_cable_is_slack(long_robot, tilt):
    trajectory = Circle(long_robot, 0.03, 0.01, tilt)
    path = check_feasibility(trajectory, long_robot, LIMITS)
    off, turned = checked(trajectory, long_robot, path)
    assert off < 5e-5
    assert turned < np.radians(0.05)
    assert path.tension.min() > LIMITS.floor


def test_redundant_cables_follow_a_position_without_jumps(long_robot):
    path = check_feasibility(Circle(long_robot, 0.08, 0.04, turn=20.0), long_robot, LIMITS)
    assert np.abs(path.speed).max() < 0.03


def test_standing_still_at_rest_needs_no_drive(robot):
    path = check_feasibility(Circle(robot, 0.0), robot, LIMITS)
    assert np.abs(path.drive).max() < 1e-6
    np.testing.assert_allclose(path.tension, np.tile(robot.rest.tension, (path.time.size, 1)), atol=1e-3)


def refused(trajectory, robot, limits=LIMITS):
    with pytest.raises(InfeasibleError) as caught:
        check_feasibility(trajectory, robot, limits)
    assert caught.value.hint
    return caught.value


def test_a_drive_that_would_be_too_fast_is_named_with_the_first_time(robot):
    trajectory = Circle(robot, 0.03, 0.04)
    fastest = np.abs(check_feasibility(trajectory, robot, LIMITS).speed).max(axis=1)
    limit = 0.8 * fastest.max()
    error = refused(trajectory, robot, replace(LIMITS, speed=limit))
    first = np.flatnonzero(fastest > limit)[0]
    assert error.quantity.startswith("speed of drive c")
    assert (error.unit, error.limit) == ("mm/s", pytest.approx(1e3 * limit))
    assert error.time == pytest.approx((first + 1) * INTERVAL)
    assert error.exit_code == 2


def test_a_tension_outside_its_limits_is_named(robot):
    error = refused(Circle(robot, 0.03, 0.04), robot, replace(LIMITS, ceiling=7.0))
    assert (error.unit, error.limit) == ("N", 7.0)
    assert error.value > 7.0
    low = refused(Circle(robot, 0.08, -0.02), robot)
    assert (low.unit, low.limit) == ("N", 1.0)
    assert low.value < 1.0


def test_a_drive_beyond_its_stroke_is_named(robot):
    short = replace(robot, stroke=(-0.1, 0.02))
    error = refused(Circle(robot, 0.0, 0.04), short)
    assert (error.quantity[:15], error.unit, error.limit) == ("length of drive", "mm", pytest.approx(20.0))
    assert error.value > 20.0


def test_a_place_out_of_reach_is_reported_with_the_distance_left(robot):
    limits = DriveLimits(speed=10.0, floor=0.0, ceiling=1e3)
    error = refused(Circle(robot, 0.0, -0.3), robot, limits)
    assert error.unit == "mm"
    assert error.value > 1.0


def test_a_jump_is_too_fast(robot):
    class Jump(Circle):
        def position(self, t):
            return self.robot.rest_position + np.where(t > 3.0, 0.03, 0.0)[:, None] * np.array(
                [0.0, 0.0, 1.0]
            )

    error = refused(Jump(robot, 0.0), robot)
    assert error.quantity.startswith("speed of drive")
    assert 3.0 < error.time <= 3.0 + INTERVAL
