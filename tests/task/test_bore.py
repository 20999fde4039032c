"""A ray through a bore, against a ray that is followed in small steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.numerics.rotation import normal_from_angles
from tcrctl.task.bore import Bore, clearance, off_axis, plane_hit

angle = st.floats(-0.3, 0.3)
small = st.floats(-0.02, 0.02)
BORE = Bore(np.array([0.1, -0.2, 0.3]), normal_from_angles(0.4, -0.7), 0.2, 0.008)


def aimed(shift, turn, before):
    """A ray from ``before`` the entry, beside the axis by ``shift`` and turned by ``turn``."""
    side = np.cross(BORE.axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, BORE.axis)
    direction = BORE.axis + turn[0] * side + turn[1] * up
    return BORE.entry - before * BORE.axis + shift[0] * side + shift[1] * up, direction / np.linalg.norm(
        direction
    )


@pytest.mark.slow
@given(st.tuples(small, small), st.tuples(angle, angle), st.floats(0.001, 0.1))
def test_the_clearance_is_that_of_the_worst_point_on_the_way_through(shift, turn, before):
    origin, direction = aimed(shift, turn, before)
    way = origin + np.linspace(0.0, 0.5, 20001)[:, None] * direction
    depth = (way - BORE.entry) @ BORE.axis
    inside = way[(depth >= 0.0) & (depth <= BORE.length)] - BORE.entry
    off = np.linalg.norm(inside - np.outer(inside @ BORE.axis, BORE.axis), axis=1)
    assert clearance(origin, direction, BORE) <= BORE.radius - off.max() + 1e-12
    assert math.isclose(clearance(origin, direction, BORE), BORE.radius - off.max(), abs_tol=2e-5)


def test_a_ray_on_the_axis_is_a_radius_clear_and_one_the_other_way_does_not_go_through():
    origin, direction = aimed((0.0, 0.0), (0.0, 0.0), 0.05)
    assert math.isclose(clearance(origin, direction, BORE), BORE.radius, rel_tol=1e-12)
    assert clearance(origin, -direction, BORE) == -math.inf
    assert clearance(origin + 0.06 * direction, direction, BORE) == -math.inf  # begins inside


@given(st.tuples(small, small), st.tuples(angle, angle))
def test_a_ray_keeps_its_distance_from_the_axis_when_all_is_turned_about_it(shift, turn):
    origin, direction = aimed(shift, turn, 0.05)
    half_turn = 2.0 * np.outer(BORE.axis, BORE.axis) - np.eye(3)
    turned = BORE.entry + half_turn @ (origin - BORE.entry)
    was, now = clearance(origin, direction, BORE), clearance(turned, half_turn @ direction, BORE)
    assert math.isclose(was, now, abs_tol=1e-12)


def test_a_plane_is_hit_where_the_ray_meets_it_or_never():
    origin, up = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0])
    slanted = np.array([0.6, 0.0, 0.8])
    assert math.isclose(plane_hit(origin, slanted, np.array([0.0, 0.0, 7.0]), 3.0 * up), 5.0)
    assert plane_hit(origin, -slanted, np.array([0.0, 0.0, 7.0]), up) == math.inf
    assert plane_hit(origin, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 7.0]), up) == math.inf
    assert plane_hit(origin, slanted, origin, up) == 0.0


def test_the_spot_behind_the_bore_moves_in_proportion_to_the_slope():
    slope = 0.01
    origin, direction = aimed((0.0, 0.0), (slope, 0.0), 0.05)
    assert math.isclose(off_axis(origin, direction, BORE, 0.3), 0.35 * slope, rel_tol=1e-9)
    assert off_axis(origin, -direction, BORE, 0.3) == math.inf
