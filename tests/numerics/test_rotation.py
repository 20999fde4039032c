from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tcrctl.numerics.rotation import (
    angle_between,
    angles_from_normal,
    matrix_from_quaternion,
    normal_from_angles,
    perpendicular,
    quaternion_conjugate,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    quaternion_multiply,
    quaternion_slerp,
    rotation_between,
    slerp,
)

TIGHT = 1e-12
untimed = settings(deadline=None)  # the first call of a kernel compiles it
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
seeds = st.integers(0, 2**32 - 1)


def unit(seed, size):
    vector = np.random.default_rng(seed).normal(size=size)
    return vector / np.linalg.norm(vector)


quaternions = seeds.map(lambda seed: unit(seed, 4))
directions = seeds.map(lambda seed: unit(seed, 3))
fractions = st.floats(0.0, 1.0).map(lambda f: np.array([f]))


def same_rotation(a, b, tolerance=TIGHT):
    return min(np.abs(a - b).max(), np.abs(a + b).max()) < tolerance


@pytest.mark.slow
@untimed
@given(quaternions, quaternions, quaternions)
def test_rotations_are_a_group(a, b, c):
    left = quaternion_multiply(quaternion_multiply(a, b), c)
    assert np.allclose(left, quaternion_multiply(a, quaternion_multiply(b, c)), atol=TIGHT)
    assert np.allclose(quaternion_multiply(a, IDENTITY), a, atol=TIGHT)
    assert np.allclose(quaternion_multiply(IDENTITY, a), a, atol=TIGHT)
    assert np.allclose(quaternion_multiply(a, quaternion_conjugate(a)), IDENTITY, atol=TIGHT)


@pytest.mark.slow
@untimed
@given(quaternions, quaternions)
def test_matrices_multiply_like_quaternions_and_agree_with_scipy(a, b):
    product = matrix_from_quaternion(quaternion_multiply(a, b))
    assert np.allclose(product, matrix_from_quaternion(a) @ matrix_from_quaternion(b), atol=TIGHT)
    assert np.allclose(product @ product.T, np.eye(3), atol=TIGHT)
    assert np.linalg.det(product) == pytest.approx(1.0)
    assert np.allclose(matrix_from_quaternion(a), Rotation.from_quat(np.roll(a, -1)).as_matrix(), atol=TIGHT)


@pytest.mark.slow
@untimed
@given(quaternions)
def test_a_matrix_gives_back_its_quaternion(q):
    assert same_rotation(quaternion_from_matrix(matrix_from_quaternion(q)), q)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_about_the_axes_survive_the_matrix(axis):
    q = np.zeros(4)
    q[1 + axis] = 1.0
    assert same_rotation(quaternion_from_matrix(matrix_from_quaternion(q)), q)


@untimed
@given(directions, st.floats(-15.0, math.log10(math.pi - 1e-9)))
def test_log_undoes_exp_at_every_magnitude(axis, exponent):
    rotation = 10.0**exponent * axis
    error = quaternion_log(quaternion_exp(rotation)) - rotation
    assert np.linalg.norm(error) < TIGHT * np.linalg.norm(rotation)


@untimed
@given(quaternions)
def test_exp_undoes_log_and_log_is_the_shorter_way(q):
    rotation = quaternion_log(q)
    assert same_rotation(quaternion_exp(rotation), q)
    assert np.linalg.norm(rotation) <= math.pi + TIGHT


@untimed
@given(directions, st.floats(-12.0, 3.0))
def test_exp_agrees_with_scipy(axis, exponent):
    rotation = 10.0**exponent * axis
    assert same_rotation(
        quaternion_exp(rotation), np.roll(Rotation.from_rotvec(rotation).as_quat(), 1), 1e-10
    )


@untimed
@given(directions, directions)
def test_rotation_between_reaches_its_target_without_twist(n0, n1):
    q = rotation_between(n0, n1)
    assert np.allclose(matrix_from_quaternion(q) @ n0, n1, atol=TIGHT)
    rotation = quaternion_log(q)
    assert abs(rotation @ n0) < TIGHT
    assert abs(rotation @ n1) < TIGHT
    assert np.linalg.norm(rotation) == pytest.approx(angle_between(n0, n1))


@untimed
@given(directions)
def test_opposite_directions_are_half_a_turn_apart(n):
    q = rotation_between(n, -n)
    assert np.allclose(matrix_from_quaternion(q) @ n, -n, atol=TIGHT)
    assert np.linalg.norm(quaternion_log(q)) == pytest.approx(math.pi)
    middle = slerp(n, -n, np.array([0.5]))[0]
    assert abs(middle @ n) < TIGHT
    assert np.linalg.norm(middle) == pytest.approx(1.0)
    assert abs(perpendicular(n) @ n) < TIGHT


@untimed
@given(directions, st.floats(-7.0, 0.0), st.booleans())
def test_angles_are_exact_near_zero_and_near_pi(n, exponent, opposite):
    tilt = 10.0**exponent
    turned = math.cos(tilt) * n + math.sin(tilt) * perpendicular(n)
    measured = angle_between(n, -turned if opposite else turned)
    # the vectors themselves are rounded to 1e-16; arccos would be off by 1e-8
    assert measured == pytest.approx(math.pi - tilt if opposite else tilt, abs=1e-15, rel=1e-14)


@untimed
@given(directions, directions, fractions)
def test_slerp_moves_on_the_great_circle_at_constant_speed(a, b, fraction):
    point = slerp(a, b, fraction)[0]
    angle = angle_between(a, b)
    assert np.linalg.norm(point) == pytest.approx(1.0)
    assert angle_between(a, point) == pytest.approx(fraction[0] * angle, abs=1e-10)
    assert angle_between(point, b) == pytest.approx((1.0 - fraction[0]) * angle, abs=1e-10)


@untimed
@given(directions, st.floats(-16.0, 0.0))
def test_rotation_between_is_exact_near_opposite_directions(n0, exponent):
    n1 = 10.0**exponent * perpendicular(n0) - n0
    n1 /= np.linalg.norm(n1)
    assert np.allclose(matrix_from_quaternion(rotation_between(n0, n1)) @ n0, n1, atol=4e-15, rtol=0.0)


@untimed
@given(directions, st.floats(-16.0, 0.0))
def test_slerp_keeps_its_ends_for_any_distance(a, exponent):
    b = a + 10.0**exponent * perpendicular(a)
    b /= np.linalg.norm(b)
    ends = slerp(a, b, np.array([0.0, 1.0]))
    assert np.allclose(ends, [a, b], atol=4e-15, rtol=0.0)


@pytest.mark.slow
@untimed
@given(quaternions, quaternions, fractions)
def test_quaternion_slerp_turns_the_short_way_at_constant_speed(a, b, fraction):
    def turn(p, q):
        return np.linalg.norm(quaternion_log(quaternion_multiply(q, quaternion_conjugate(p))))

    q = quaternion_slerp(a, b, fraction)[0]
    assert turn(a, q) == pytest.approx(fraction[0] * turn(a, b), abs=1e-10)
    assert turn(q, b) == pytest.approx((1.0 - fraction[0]) * turn(a, b), abs=1e-10)
    assert turn(a, b) <= math.pi + TIGHT


@untimed
@given(st.floats(-math.pi, math.pi), st.floats(-1.57, 1.57))
def test_orientation_angles_survive_the_normal(theta_x, theta_y):
    n = normal_from_angles(theta_x, theta_y)
    assert np.linalg.norm(n) == pytest.approx(1.0)
    back_x, back_y = angles_from_normal(n)
    # theta_x gets soft where the normal comes near the x axis
    assert math.remainder(back_x - theta_x, math.tau) == pytest.approx(0.0, abs=1e-12 / math.cos(theta_y))
    assert back_y == pytest.approx(theta_y, abs=TIGHT)


@untimed
@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5))
def test_orientation_angles_turn_about_x_then_about_the_turned_y(theta_x, theta_y):
    ring = np.array([[math.cos(a), math.sin(a), 0.0] for a in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)])
    r1, r2, r3 = Rotation.from_euler("XY", [theta_x, theta_y]).apply(ring)
    normal = -np.cross(r3 - r2, r2 - r1)  # correction 6: as printed the normal points down
    normal /= np.linalg.norm(normal)
    assert np.allclose(normal, normal_from_angles(theta_x, theta_y), atol=TIGHT)


def test_the_resting_normal_has_no_angles():
    assert angles_from_normal(np.array([0.0, 0.0, 1.0])) == (0.0, 0.0)
