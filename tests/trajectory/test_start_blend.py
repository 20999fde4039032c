"""The offset of the start pose, and how it fades out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcrctl.numerics.rotation import angle_between, normal_from_angles
from tcrctl.trajectory.start_blend import StartBlend, fade_out

UP = np.array([0.0, 0.0, 1.0])
angles = st.floats(-0.5, 0.5)
places = st.tuples(*[st.floats(-0.02, 0.02)] * 3).map(np.array)


class Swing:
    """Moves on a circle, its normal tilting."""

    duration = 10.0

    def position(self, t):
        return np.stack([0.05 * np.cos(t), 0.05 * np.sin(t), -0.5 + 0.0 * t], axis=1)

    def normal(self, t):
        return np.array([normal_from_angles(0.3 * np.sin(x), 0.2 * np.cos(x)) for x in t])


class Free(Swing):
    def normal(self, t):
        return None


@pytest.mark.slow
@settings(deadline=None)  # the first call loads kernels
@given(places, angles, angles, st.floats(0.1, 5.0))
def test_it_begins_where_the_robot_is_and_joins_the_trajectory(offset, theta_x, theta_y, blend):
    position, normal = Swing().position(np.zeros(1))[0] + offset, normal_from_angles(theta_x, theta_y)
    blended = StartBlend(Swing(), position, normal, blend)
    np.testing.assert_allclose(blended.position(np.zeros(1))[0], position, atol=1e-15)
    np.testing.assert_allclose(blended.normal(np.zeros(1))[0], normal, atol=1e-12)
    late = blend + np.linspace(0.0, 10.0, 7)
    np.testing.assert_array_equal(blended.position(late), Swing().position(late))
    np.testing.assert_allclose(blended.normal(late), Swing().normal(late), atol=1e-15)


@settings(deadline=None)  # the first call loads kernels
@given(places, angles, angles)
def test_the_normal_stays_a_unit_vector_and_the_offset_only_shrinks(offset, theta_x, theta_y):
    start = normal_from_angles(theta_x, theta_y)
    blended = StartBlend(Swing(), Swing().position(np.zeros(1))[0] + offset, start, 2.0)
    t = np.linspace(0.0, 2.0, 41)
    normal, wanted = blended.normal(t), Swing().normal(t)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)
    left = np.linalg.norm(blended.position(t) - Swing().position(t), axis=1)
    assert (np.diff(left) <= 1e-15).all()
    turn = angle_between(Swing().normal(np.zeros(1))[0], start)
    assert all(angle_between(a, b) <= turn + 1e-7 for a, b in zip(normal, wanted, strict=True))


def test_the_fade_is_smooth_up_to_the_third_derivative():
    for end in (0.0, 1.0):
        for h in (1e-2, 1e-3):
            inside = fade_out(np.array([abs(end - h)]))[0]
            assert abs(inside - (1.0 - end)) == pytest.approx(35.0 * h**4, rel=4 * h)


def test_a_free_orientation_stays_free():
    assert StartBlend(Free(), np.zeros(3), UP, 2.0).normal(np.zeros(4)) is None


def test_without_blending_the_trajectory_is_unchanged():
    t = np.linspace(0.0, 10.0, 11)
    blended = StartBlend(Swing(), np.ones(3), UP, 0.0)
    np.testing.assert_array_equal(blended.position(t), Swing().position(t))
    np.testing.assert_array_equal(blended.normal(t), Swing().normal(t))
    assert blended.duration == Swing.duration


def test_a_robot_far_away_first_goes_to_the_start_and_no_faster_than_it_may():
    place = Swing().position(np.zeros(1))[0] + np.array([0.03, -0.04, 0.0])
    blended = StartBlend(Swing(), place, UP, 2.0, speed=0.02)
    assert blended.duration == Swing.duration + blended.approach
    t = np.linspace(0.0, blended.approach, 2001)
    path = blended.position(t)
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / np.diff(t)
    assert 0.0199 < speed.max() < 0.02 + 1e-9
    np.testing.assert_allclose(path[[0, -1]], [place, Swing().position(np.zeros(1))[0]], atol=1e-15)
    later = np.linspace(0.0, 10.0, 7)
    np.testing.assert_allclose(
        blended.position(blended.approach + later), Swing().position(later), atol=1e-12
    )
    np.testing.assert_allclose(blended.normal(blended.approach + later), Swing().normal(later), atol=1e-12)


def test_a_robot_near_enough_does_not_wait():
    place = Swing().position(np.zeros(1))[0] + np.array([0.0, 0.001, 0.0])
    assert StartBlend(Swing(), place, UP, 2.0, speed=0.02).duration == Swing.duration
    assert StartBlend(Swing(), place + 0.1, UP, 0.0, speed=0.02).duration == Swing.duration
