"""Distances to plates with holes, against dense sampling of segment and plate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.task.perforated_plate import (
    Plates,
    blocks,
    crosses,
    nearest,
    point_distance,
    segment_distance,
)

HALF = np.array([0.05, 0.04])
HOLES = np.array([[0.012, 0.004, 0.02], [-0.03, -0.02, 0.01]])
NONE = np.empty((0, 3))
TOLERANCE = 1e-5
coordinate = st.floats(-0.09, 0.09)
points = st.tuples(coordinate, coordinate, coordinate).map(np.array)


def grid(holes, n=161):
    """Points of the plate, its rims included (k, 3)."""
    u, v = np.meshgrid(np.linspace(-HALF[0], HALF[0], n), np.linspace(-HALF[1], HALF[1], n))
    flat = np.stack((u.ravel(), v.ravel(), np.zeros(n * n)), axis=1)
    for hole in holes:
        flat = flat[np.hypot(flat[:, 0] - hole[0], flat[:, 1] - hole[1]) >= hole[2]]
    turn = np.linspace(0.0, 2.0 * math.pi, 400)
    rims = [
        np.stack((u + radius * np.cos(turn), v + radius * np.sin(turn), 0.0 * turn), axis=1)
        for u, v, radius in holes
    ]
    return np.concatenate((flat, *rims))


GRID = grid(HOLES)


@given(points)
def test_the_distance_of_a_point_is_that_of_the_nearest_point_of_the_plate(point):
    sampled = np.linalg.norm(GRID - point, axis=1).min()
    found = point_distance(*point, HALF, HOLES)
    assert found <= sampled + 1e-12
    assert found >= sampled - 5e-4  # half the grid's diagonal


@given(points, points)
def test_the_distance_of_a_segment_is_the_least_one_of_its_points(start, end):
    way = start + np.linspace(0.0, 1.0, 501)[:, None] * (end - start)
    sampled = min(point_distance(*point, HALF, HOLES) for point in way)
    found = segment_distance(start, end, HALF, HOLES, 1.0, TOLERANCE)
    assert found <= sampled + TOLERANCE
    assert found >= sampled - np.linalg.norm(end - start) / 1000.0 - 1e-12
    reversed_way = segment_distance(end, start, HALF, HOLES, 1.0, TOLERANCE)
    assert abs(found - reversed_way) <= 2.0 * TOLERANCE


@given(points, points, st.floats(0.0, 0.05))
def test_distances_beyond_the_farthest_of_interest_are_cut(start, end, farthest):
    full = segment_distance(start, end, HALF, HOLES, 1.0, TOLERANCE)
    cut = segment_distance(start, end, HALF, HOLES, farthest, TOLERANCE)
    assert cut <= farthest
    assert abs(cut - min(full, farthest)) <= 2.0 * TOLERANCE


@pytest.mark.slow
@given(points, points)
def test_a_segment_that_crosses_the_material_touches_it_and_one_through_a_hole_does_not(start, end):
    if crosses(start, end, HALF, HOLES):
        assert segment_distance(start, end, HALF, HOLES, 1.0, TOLERANCE) <= 2.0 * TOLERANCE
    if crosses(start, end, HALF, HOLES) != crosses(start, end, HALF, NONE):
        at = start[2] / (start[2] - end[2])
        hit = start + at * (end - start)
        assert (np.hypot(hit[0] - HOLES[:, 0], hit[1] - HOLES[:, 1]) < HOLES[:, 2]).any()


def test_a_segment_through_the_middle_of_a_hole_is_as_far_as_its_rim():
    u, v, radius = HOLES[0]
    start, end = np.array([u, v, -0.1]), np.array([u, v, 0.1])
    assert not crosses(start, end, HALF, HOLES)
    assert math.isclose(segment_distance(start, end, HALF, HOLES, 1.0, TOLERANCE), radius, abs_tol=TOLERANCE)


@pytest.mark.slow
@given(points, points, points)
def test_nothing_changes_when_plates_and_segments_move_together(start, end, rotation):
    still = Plates(np.zeros((1, 3)), np.eye(3)[None], HALF[None], np.array([0, 2]), HOLES)
    turn, shift = matrix_from_quaternion(quaternion_exp(30.0 * rotation)), np.array([0.3, -0.2, 0.1])
    moved = Plates(shift[None], turn.T[None], HALF[None], np.array([0, 2]), HOLES)
    here = nearest(still, start[None], end[None], 1.0, TOLERANCE)
    there = nearest(moved, (turn @ start + shift)[None], (turn @ end + shift)[None], 1.0, TOLERANCE)
    assert abs(here[0] - there[0]) < 2.0 * TOLERANCE
    assert here[1:] == there[1:] == (0, 0)


def test_the_nearest_pair_of_many_is_found_and_named():
    two = Plates(
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]),
        np.stack((np.eye(3), np.eye(3))),
        np.stack((HALF, HALF)),
        np.array([0, 0, 0]),
        NONE,
    )
    start = np.array([[0.0, 0.0, 0.2], [0.0, 0.0, 0.45], [1.0, 1.0, 0.25]])
    distance, segment, plate = nearest(two, start, start + np.array([0.0, 0.0, 0.02]), 1.0, TOLERANCE)
    assert (segment, plate) == (1, 1)
    assert math.isclose(distance, 0.03, abs_tol=TOLERANCE)
    assert nearest(two, start, start, 0.01, TOLERANCE) == (0.01, -1, -1)
    assert blocks(two, np.array([0.0, 0.0, 0.4]), np.array([0.0, 0.0, 0.6]))
    assert not blocks(two, np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.0, 0.4]))
