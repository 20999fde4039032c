"""Speeds that the reference needs: what they do to the end, and what they leave as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from support.closed_loop import closed_loop, constant, pose_settings, resting
from tcrctl.controller.blocks import block_edges
from tcrctl.controller.controller import build_controller
from tcrctl.controller.feedforward import needed_speeds, wanted_changes
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium

OUTPUT = np.array([7.2e4] * 3 + [44.0] * 3)
EDGES = block_edges(16, 4)
SPACING = 0.05


def moving(velocity, instants=16):
    """Poses of an end that moves with a constant rate of its six coordinates."""
    return np.arange(instants + 1)[:, None] * SPACING * velocity


@pytest.mark.parametrize("seed", range(10))
def test_with_as_many_drives_as_coordinates_the_end_follows_exactly(seed):
    rng = np.random.default_rng(seed)
    gain = np.diag([5.0, 5.0, 1.0, 20.0, 20.0, 20.0]) @ np.linalg.qr(rng.standard_normal((6, 6)))[0]
    velocity = 0.01 * rng.standard_normal(6)
    needed = needed_speeds(gain, OUTPUT, moving(velocity), EDGES, SPACING)
    for speeds in needed:
        np.testing.assert_allclose(gain @ speeds, velocity, rtol=1e-2, atol=2e-5)


def test_drives_that_the_pose_does_not_need_stand_still():
    rng = np.random.default_rng(0)
    gain = np.hstack([rng.standard_normal((6, 3)), np.zeros((6, 3))])
    needed = needed_speeds(gain, OUTPUT, moving(gain[:, :3] @ [0.01, 0.02, -0.01]), EDGES, SPACING)
    assert np.array_equal(needed[:, 3:], np.zeros((4, 3)))
    np.testing.assert_allclose(needed[:, :3], np.tile([0.01, 0.02, -0.01], (4, 1)), rtol=1e-2)


def test_each_block_has_the_mean_velocity_of_its_own_time():
    poses = np.zeros((17, 6))
    poses[int(EDGES[2]) :, 0] = SPACING * np.arange(17 - int(EDGES[2]))
    needed = needed_speeds(np.eye(6), OUTPUT, poses, EDGES, SPACING)
    np.testing.assert_allclose(needed[:, 0], [0.0, 0.0, 1.0, 1.0], rtol=1e-3)


def test_changes_lead_from_the_speed_needed_before_to_every_later_one():
    rng = np.random.default_rng(3)
    needed, before = rng.standard_normal((4, 6)), rng.standard_normal(6)
    changes = wanted_changes(before, before, needed).reshape(4, 6)
    np.testing.assert_allclose(np.cumsum(changes, axis=0), needed)


def test_without_need_only_the_last_input_is_kept():
    previous = np.arange(6.0)
    changes = wanted_changes(previous, np.zeros(6), np.zeros((3, 6)))
    assert np.array_equal(changes, np.concatenate([previous, np.zeros(12)]))


def test_the_gain_at_rest_is_the_derivative_of_the_pose_by_the_drives(tcr700):
    drive, h = np.array([3.0, 1.0, 0.0, 1.0, 2.0, 1.5]) / 1000.0, 1e-6
    at = equilibrium(tcr700.model, drive, tcr700.weight, tcr700.rest.q)
    gain = pose.drive_gain(at.q, at.gain, tcr700.tip)
    for c in range(6):
        moved = equilibrium(tcr700.model, drive + h * np.eye(6)[c], tcr700.weight, at.q)
        slope = (pose.position(moved.q, tcr700.tip) - pose.position(at.q, tcr700.tip)) / h
        np.testing.assert_allclose(gain[:3, c], slope, atol=2e-3 * np.abs(gain[:3]).max())


def test_about_a_resting_reference_the_loop_is_the_same_to_the_byte(tcr700):
    runs = [
        closed_loop(tcr700, pose_settings(feedforward=on), (0.004, 0.002, 0.01), 0.5)[1]
        for on in (False, True)
    ]
    assert runs[0].tobytes() == runs[1].tobytes()


def test_a_moving_reference_is_met_with_the_speeds_it_needs_in_the_first_step(tcr700):
    """A large W forbids any change of speed but the free one."""
    weights = pose_settings().weights.model_copy(update={"speed_change": 1e9})
    controller = build_controller(pose_settings().model_copy(update={"weights": weights}), tcr700)
    still = constant(tcr700, controller)
    velocity = np.array([0.002, 0.001, 0.004])
    away = controller.ahead[:, None] * velocity
    command, info = controller.control(
        resting(tcr700), replace(still, ahead_position=still.ahead_position + away)
    )
    gain = pose.drive_gain(tcr700.rest.q, tcr700.rest.gain, tcr700.tip)
    assert info.converged
    np.testing.assert_allclose(gain[:3] @ command.speed, velocity, rtol=0.05)
