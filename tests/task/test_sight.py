"""What a camera sees, against rays to points of the balls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tcrctl.task.sight import hides, in_view

coordinate = st.floats(-0.1, 0.1)
points = st.tuples(coordinate, coordinate, coordinate).map(np.array)
AHEAD = np.array([1.0, 0.0, 0.0])
EYE = np.zeros(3)
HALF = math.radians(30.0)


def surface(centre, radius, n=400):
    """Points spread over a ball's surface (n, 3)."""
    z = 1.0 - 2.0 * (np.arange(n) + 0.5) / n
    turn = math.pi * (1.0 + math.sqrt(5.0)) * np.arange(n)
    flat = np.sqrt(1.0 - z**2)
    return centre + radius * np.stack((flat * np.cos(turn), flat * np.sin(turn), z), axis=1)


@given(points, st.floats(0.001, 0.02))
def test_a_ball_is_in_the_picture_if_all_of_it_is_within_the_cone(centre, radius):
    assume(np.linalg.norm(centre) > radius)
    seen = surface(centre, radius)
    off = np.arctan2(np.hypot(seen[:, 1], seen[:, 2]), seen[:, 0])
    if in_view(EYE, AHEAD, centre, radius, HALF, 1.0):
        assert off.max() <= HALF
    else:
        assert off.max() > HALF - 0.3 * radius / np.linalg.norm(centre)


def test_what_is_too_far_or_around_the_camera_is_not_seen():
    assert in_view(EYE, AHEAD, 0.08 * AHEAD, 0.01, HALF, 0.08)
    assert not in_view(EYE, AHEAD, 0.0801 * AHEAD, 0.01, HALF, 0.08)
    assert not in_view(EYE, AHEAD, 0.009 * AHEAD, 0.01, HALF, 0.08)
    assert not in_view(EYE, -AHEAD, 0.05 * AHEAD, 0.01, HALF, 0.08)


@pytest.mark.slow
@given(points, points, points, st.floats(0.001, 0.03))
def test_a_ball_hides_a_point_if_it_meets_the_line_of_sight(eye, target, centre, radius):
    assume(np.linalg.norm(target - eye) > 1e-3)
    way = eye + np.linspace(0.0, 1.0, 1001)[:, None] * (target - eye)
    nearest = np.linalg.norm(way - centre, axis=1).min()
    assume(abs(nearest - radius) > 2e-4)
    assert hides(eye, target, centre, radius) == (nearest < radius)
