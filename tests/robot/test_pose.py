"""End pose of a ring: centroid, normal, twist and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support import mechanics
from tcrctl.robot import pose

ANGLE = st.floats(-1.2, 1.2)
CORNERS = 2 * np.pi / 3 * np.arange(3)


def ring(rotation=((1, 0, 0), (0, 1, 0), (0, 0, 1)), centre=(0.0, 0.0, 0.0), radius=0.035):
    """Coordinates (9,) of a ring whose node 1 lies on its own x axis."""
    flat = radius * np.stack([np.cos(CORNERS), np.sin(CORNERS), 0 * CORNERS], axis=1)
    return (flat @ np.asarray(rotation).T + centre).ravel()


def outputs(q, first=0):
    return np.concatenate([pose.position(q, first), pose.normal(q, first), [pose.twist(q, first)]])


def test_a_ring_at_rest_has_its_normal_up_and_no_twist(tcr700):
    np.testing.assert_allclose(pose.normal(ring(), 0), [0.0, 0.0, 1.0], atol=1e-15)
    assert pose.twist(ring(), 0) == pytest.approx(0.0, abs=1e-15)
    for name in range(0, 4 * 14, 4):
        np.testing.assert_allclose(pose.normal(tcr700.rest.q, name), [0.0, 0.0, 1.0], atol=1e-9)


@given(x=ANGLE, y=ANGLE, z=ANGLE)
def test_position_and_normal_follow_a_rigid_ring(x, y, z):
    R, centre = mechanics.turned(np.array([x, y, z])), np.array([0.1, -0.2, 0.3])
    q = ring(R, centre)
    np.testing.assert_allclose(pose.position(q, 0), centre, atol=1e-15)
    np.testing.assert_allclose(pose.normal(q, 0), R[:, 2], atol=1e-14)


@given(x=ANGLE, y=ANGLE, twist=ANGLE)
def test_twist_is_what_remains_beside_the_shortest_rotation(x, y, twist):
    tilt = mechanics.turned(
        np.array([x, y, 0.0])
    )  # an axis in the plane: the shortest rotation to its normal
    q = ring(tilt @ mechanics.turned(np.array([0.0, 0.0, twist])))
    assert pose.twist(q, 0) == pytest.approx(twist, abs=1e-12)


@given(x=ANGLE, y=ANGLE, z=ANGLE, seed=st.integers(0, 10**6))
def test_the_output_matrix_is_the_derivative_of_position_and_normal_of_any_ring(x, y, z, seed):
    rng = np.random.default_rng(seed)
    q = ring(mechanics.turned(np.array([x, y, z])), rng.standard_normal(3)) + 0.003 * rng.standard_normal(9)
    C = pose.output_matrix(q, 0)
    slope = mechanics.slopes(lambda x: outputs(x)[:6], q, 1e-7)
    np.testing.assert_allclose(C[:6], slope, atol=1e-6)


@given(x=ANGLE, y=ANGLE, z=ANGLE, rate=st.floats(-3.0, 3.0))
def test_the_last_row_is_the_spin_about_the_normal(x, y, z, rate):
    R = mechanics.turned(np.array([x, y, z]))
    q = ring(R, (0.2, 0.1, -0.5))
    arms = q.reshape(3, 3) - pose.position(q, 0)
    spinning = rate * np.cross(R[:, 2], arms).ravel()
    tilting = np.cross(R[:, 0], arms).ravel()
    C = pose.output_matrix(q, 0)
    assert (C @ spinning)[6] == pytest.approx(rate, abs=1e-12)
    np.testing.assert_allclose((C @ spinning)[:6], 0.0, atol=1e-12)
    assert (C @ tilting)[6] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose((C @ tilting)[3:6], np.cross(R[:, 0], R[:, 2]), atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_last_row_is_the_derivative_of_the_twist_when_a_ring_turns_from_rest(axis):
    vector = 1e-6 * np.eye(3)[axis]
    ahead, behind = ring(mechanics.turned(vector)), ring(mechanics.turned(-vector))
    slope = (pose.twist(ahead, 0) - pose.twist(behind, 0)) / 2e-6
    velocity = (ahead - behind) / 2e-6
    assert (pose.output_matrix(ring(), 0) @ velocity)[6] == pytest.approx(slope, abs=1e-9)


def test_the_pose_is_that_of_the_ring_asked_for(tcr700):
    q = mechanics.deformed(tcr700, 4)
    own = q.reshape(-1, 3)[32:35].ravel()
    assert np.array_equal(outputs(q, 32), outputs(own))
    assert np.array_equal(pose.output_matrix(q, 32), pose.output_matrix(own, 0))
