"""A robot from Python: what it says of itself agrees with its derivatives, its energy and its limits."""

from __future__ import annotations

import numpy as np
import pytest

import tcrctl
from tcrctl.errors import InfeasibleError, InputError, UnknownNameError

H = 1e-5


@pytest.fixture(scope="module")
def robot():
    return tcrctl.Robot("tcr600")


def test_at_zero_drive_it_hangs_as_built(robot, tcr600):
    rest = robot.statics()
    assert (robot.name, robot.cables) == ("tcr600", tcr600.cable_names)
    np.testing.assert_allclose(rest.position, tcr600.rest_position, atol=1e-9)
    np.testing.assert_allclose(rest.normal, [0.0, 0.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(rest.nodes.ravel(), tcr600.rest.q, atol=1e-9)
    np.testing.assert_allclose(rest.tension, rest.tension[0], rtol=1e-6)  # three cables alike


def test_shorter_cables_pull_the_end_up_and_one_bends_it_to_its_side(robot):
    rest, up = robot.statics(), robot.statics([0.02] * 3)
    assert up.position[2] > rest.position[2] + 5e-3
    assert up.length == pytest.approx(rest.length - 0.02, abs=2e-3)
    bent = robot.statics([0.02, 0.0, 0.0])
    assert np.hypot(*bent.position[:2]) > 10e-3


@pytest.mark.parametrize("drive", [(0.0, 0.0, 0.0), (0.02, 0.01, 0.005)])
def test_the_jacobian_is_the_derivative_of_the_pose(robot, drive):
    found, drive = robot.jacobian(drive), np.array(drive)
    for cable, step in enumerate(H * np.eye(3)):
        after, before = robot.statics(drive + step), robot.statics(drive - step)
        np.testing.assert_allclose(
            found[:3, cable], (after.position - before.position) / (2 * H), rtol=1e-3, atol=1e-4
        )
        np.testing.assert_allclose(
            found[3:, cable], (after.normal - before.normal) / (2 * H), rtol=1e-3, atol=1e-3
        )


def test_modes_are_in_order_and_the_softest_bends_it_alike_to_both_sides(robot):
    found = robot.modes(count=4)
    assert found.shape.shape == (4, robot.statics().nodes.shape[0], 3)
    assert np.all(np.diff(found.frequency) >= 0.0)
    assert found.frequency[0] > 0.1
    assert found.frequency[1] == pytest.approx(
        found.frequency[0], rel=0.02
    )  # three cables: no side is special
    np.testing.assert_array_equal(found.shape[:, :4], 0.0)


def test_the_inverse_of_a_shape_is_the_shape(robot):
    wanted = robot.statics([0.02, 0.012, 0.015])
    found = robot.inverse(wanted.position)
    np.testing.assert_allclose(found.position, wanted.position, atol=2e-5)
    np.testing.assert_allclose(found.drive, wanted.drive, atol=5e-4)
    with pytest.raises(InfeasibleError, match="distance of the end from its pose"):
        robot.inverse([0.5, 0.0, -0.1])


@pytest.mark.slow
def test_the_workspace_lies_within_strokes_and_tensions_and_is_that_of_the_statics(robot):
    found = robot.workspace(rays=8, floor=1.0)
    assert robot.stroke[0] <= found.drive.min() <= found.drive.max() <= robot.stroke[1]
    assert found.tension[1:].min() >= 1.0
    assert found.tension.max() <= robot.tension_limit
    rest = robot.statics().position
    for i in range(0, len(found.drive), len(found.drive) // 5):
        np.testing.assert_allclose(robot.statics(found.drive[i]).position - rest, found.offset[i], atol=1e-5)


def test_what_is_no_robot_and_what_are_no_drives_is_said(robot):
    with pytest.raises(UnknownNameError, match="tcr60"):
        tcrctl.Robot("tcr60")
    for drive in ([0.0, 0.0], "none", [0.0, 0.0, np.nan]):
        with pytest.raises(InputError, match="drive must be 3"):
            robot.statics(drive)
    with pytest.raises(InputError, match="count must be 1 to"):
        robot.modes(count=0)
