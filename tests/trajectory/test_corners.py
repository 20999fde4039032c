from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from support.drawings import (
    at_start,
    built,
    drawing,
    in_plane_mm,
    law,
    pair,
    to_edge,
)
from tcrctl.trajectory.corner import rounding
from tcrctl.trajectory.plane_curve import PlanePiece, turn_angle


@law
@given(st.integers(6, 150), st.sampled_from([-1, 1]), st.floats(0.5, 5.0))
def test_rounding_leaves_a_corner_by_exactly_what_the_arc_cuts_off(turn, side, radius):
    edge = 60.0
    end = edge * (1.0 + cmath.exp(1j * math.radians(side * turn)))
    section = drawing(
        {"line": [[0, 0], [edge, 0], pair(end)]},
        corner="round",
        corner_radius_mm=radius,
        corner_angle_deg=5,
        acceleration_limit_mm_s2=100.0,
        **at_start(0, 0),
    )
    trajectory = built(section)
    s = np.linspace(0.0, trajectory.time_law.arc_length(np.array([1e9]))[0], 4001)
    drawn = in_plane_mm(trajectory.path.position(s), section)[:, :2]
    sharp = np.array([[0, 0], [edge, 0], pair(end)])
    cut = radius * (1.0 / math.cos(math.radians(turn) / 2) - 1.0)
    if radius * math.tan(math.radians(turn) / 2) > edge / 2:
        cut = 0.0  # no room: the corner stays
    away = np.min([to_edge(drawn, a, b) for a, b in itertools.pairwise(sharp)], axis=0).max()
    assert np.linalg.norm(drawn - sharp[1], axis=1).min() == pytest.approx(cut, abs=0.02)
    assert away <= cut + 1e-9


@st.composite
def pieces_at_a_corner(draw):
    """Two pieces, straight or curved, that meet in 0."""
    curvature = st.one_of(st.just(0.0), st.floats(0.02, 0.5), st.floats(-0.5, -0.02))
    length = st.floats(1.0, 40.0)
    turn = math.radians(draw(st.integers(5, 179))) * draw(st.sampled_from([-1, 1]))
    back = PlanePiece(0j, -1.0 + 0j, -draw(curvature), draw(length))  # the first one, walked backwards
    before = PlanePiece(back.point(back.length), -back.direction(back.length), -back.curvature, back.length)
    return before, PlanePiece(0j, cmath.exp(1j * turn), draw(curvature), draw(length))


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@given(pieces_at_a_corner(), st.floats(0.2, 6.0))
def test_a_rounding_arc_is_tangent_to_whatever_meets_in_the_corner(pieces, radius):
    before, after = pieces
    found = rounding(before, after, radius)
    assume(found is not None)
    head, tail = before.trimmed(0.0, found.tail), after.trimmed(found.head, 0.0)
    assert head.length >= before.length / 2 - 1e-9
    assert tail.length >= after.length / 2 - 1e-9
    for first, second in ((head, found.arc), (found.arc, tail)):
        assert abs(first.point(first.length) - second.start) < 1e-8
        assert abs(turn_angle(first, second)) < 1e-6
    assert abs(found.arc.curvature) == pytest.approx(1.0 / radius)
    assert 0.0 < found.arc.length < math.pi * radius * (1 + 1e-9)


@pytest.mark.parametrize("turn", [-60, 60])
@pytest.mark.parametrize("curvatures", list(itertools.product([-0.02, 0.0, 0.02], repeat=2)))
def test_a_corner_with_room_on_both_sides_is_rounded_whatever_meets_there(turn, curvatures):
    back = PlanePiece(0j, -1.0 + 0j, -curvatures[0], 40.0)
    before = PlanePiece(back.point(40.0), -back.direction(40.0), curvatures[0], 40.0)
    after = PlanePiece(0j, cmath.exp(1j * math.radians(turn)), curvatures[1], 40.0)
    assert rounding(before, after, 3.0) is not None
