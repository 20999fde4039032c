from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.drawings import (
    DT,
    REST,
    arcs,
    at_start,
    built,
    drawing,
    drawings,
    in_plane_mm,
    law,
    limits,
    polylines,
    sampled,
    tangent_paths,
    to_edge,
)
from tcrctl.trajectory.strokes import moves


@pytest.mark.slow
@law
@given(drawings, limits, st.sampled_from(["stop", "round"]))
def test_every_drawing_keeps_its_speed_and_acceleration_limits(strokes, limit, corner):
    section = drawing(*strokes, **limit, corner=corner)
    _, position = sampled(built(section))
    velocity = 1e3 * np.diff(position, axis=0) / DT
    acceleration = np.diff(velocity, axis=0) / DT
    top = max(limit["speed_limit_mm_s"], limit["travel_speed_limit_mm_s"])
    # differences are averages of the true values, so the limits hold for them without allowance;
    # a jump of position or velocity anywhere would show up as a huge value
    assert np.linalg.norm(velocity, axis=1).max() <= top * (1 + 1e-9)
    assert np.linalg.norm(acceleration, axis=1).max() <= limit["acceleration_limit_mm_s2"] * (1 + 1e-6)


@pytest.mark.slow
@law
@given(drawings, limits)
def test_every_move_starts_and_ends_at_rest_with_ramps_no_shorter_than_asked(strokes, limit):
    for move in moves(drawing(*strokes, **limit), REST):
        if move.pieces:
            assert move.phases[0].v0 == move.phases[-1].v1 == 0.0
            assert all(a.v1 == b.v0 for a, b in itertools.pairwise(move.phases))
            covered, length = sum(p.length for p in move.phases), sum(p.length for p in move.pieces)
            assert covered == pytest.approx(length, rel=1e-9)
        assert all(p.duration >= limit["ramp_s"] for p in move.phases if p.v0 != p.v1)


@pytest.mark.slow
@law
@given(drawings, limits)
def test_the_duration_is_that_of_all_moves_and_rests(strokes, limit):
    section = drawing(*strokes, **limit, lead_in_s=1.5, dwell_s=0.25, settle_s=2.0)
    plan = list(moves(section, REST))
    moving = sum(p.duration for move in plan if move.pieces for p in move.phases)
    assert built(section).duration == pytest.approx(moving + 1.5 + 0.25 * len(strokes) + 2.0)


@pytest.mark.slow
@law
@given(drawings, limits)
def test_the_drawing_starts_at_the_rest_position_and_ends_at_its_last_point(strokes, limit):
    section = drawing(*strokes, **limit, plane={"offset_mm": [1, 2, 40]})
    trajectory = built(section)
    last = section.strokes[-1].segments[-1].ends[1]
    outside = trajectory.position(np.array([-5.0, 0.0, trajectory.duration, trajectory.duration + 1e6]))
    assert np.allclose(outside[:2], REST, atol=1e-12)
    assert np.allclose(in_plane_mm(outside[2:], section), [*last, 0.0], atol=1e-6)
    assert trajectory.normal(np.array([0.0])) is None


@pytest.mark.slow
@law
@given(polylines(), limits)
def test_a_polyline_passes_through_every_vertex_and_never_leaves_its_edges(stroke, limit):
    section = drawing(stroke, **limit, **at_start(*stroke["line"][0]))
    _, position = sampled(built(section))
    drawn = in_plane_mm(position, section)[:, :2]
    corners = np.array(stroke["line"])
    for corner in corners:
        # near a stop the sample next to the stop is off by less than a/2 dt^2
        assert np.linalg.norm(drawn - corner, axis=1).min() <= limit["acceleration_limit_mm_s2"] * DT**2
    distance = np.min([to_edge(drawn, a, b) for a, b in itertools.pairwise(corners)], axis=0)
    assert distance.max() < 1e-9


@pytest.mark.slow
@law
@given(polylines(), limits)
def test_acceleration_is_continuous_on_straight_moves(stroke, limit):
    _, position = sampled(built(drawing(stroke, **limit)))
    acceleration = 1e3 * np.diff(position, 2, axis=0) / DT**2
    top = max(limit["speed_limit_mm_s"], limit["travel_speed_limit_mm_s"])
    jerk = 10.0 / math.sqrt(3.0) * top / limit["ramp_s"] ** 2  # largest R'' of the ramp polynomial
    assert np.linalg.norm(np.diff(acceleration, axis=0), axis=1).max() <= jerk * DT * (1 + 1e-6) + 1e-6


@pytest.mark.slow
@law
@given(arcs(), limits)
def test_an_arc_keeps_its_distance_and_covers_its_angle_in_its_direction(stroke, limit):
    arc = stroke["arc"]
    start = np.array(arc["center"]) + arc["radius"] * np.array(
        [math.cos(math.radians(arc["from_deg"])), math.sin(math.radians(arc["from_deg"]))]
    )
    section = drawing(stroke, **limit, **at_start(*start))
    _, position = sampled(built(section))
    spokes = in_plane_mm(position, section)[:, :2] - arc["center"]
    assert np.allclose(np.linalg.norm(spokes, axis=1), arc["radius"], atol=1e-9)
    angle = np.rad2deg(np.unwrap(np.arctan2(spokes[:, 1], spokes[:, 0])))
    assert angle[-1] - angle[0] == pytest.approx(arc["to_deg"] - arc["from_deg"], abs=1e-6)
    assert np.all(np.diff(angle) * (arc["to_deg"] - arc["from_deg"]) >= -1e-6)


@pytest.mark.slow
@law
@given(tangent_paths(), limits)
def test_tangent_joins_are_passed_without_stopping(stroke, limit):
    start = stroke["path"][0]["line"][0]
    section = drawing(stroke, **limit, **at_start(*start, dwell_s=0.0, settle_s=0.0))
    trajectory = built(section)
    inner = np.linspace(0.0, trajectory.duration, 200)[1:-1]
    assert trajectory.time_law.speed(inner).min() > 0.0
    assert len([move for move in moves(section, REST) if move.pieces]) == 1


def test_a_long_line_takes_its_length_over_the_speed_plus_one_ramp():
    section = drawing({"line": [[0, 0], [80, 0]]}, **at_start(0, 0, dwell_s=0.0, settle_s=0.0))
    # the defaults: 20 mm/s; the ramp peaks at 15/8 of its mean acceleration, limit 30 mm/s2
    ramp = 15 / 8 * 20 / 30
    assert built(section).duration == pytest.approx(80 / 20 + ramp, rel=1e-3)


def test_a_tight_arc_is_slower_so_that_the_centripetal_acceleration_keeps_its_limit():
    stroke = {"arc": {"center": [0, 0], "radius": 2, "from_deg": 0, "to_deg": 3600}}
    trajectory = built(drawing(stroke, **at_start(2, 0), acceleration_limit_mm_s2=30))
    middle = trajectory.time_law.speed(np.array([trajectory.duration / 2]))[0]
    assert middle == pytest.approx(1e-3 * math.sqrt(30 * 2), rel=1e-6)


def test_a_ramp_on_an_arc_leaves_room_for_the_centripetal_acceleration():
    bend = {"arc": {"center": [0, 0], "radius": 14, "from_deg": -270, "to_deg": 0}}
    section = drawing({"path": [bend, {"line": [[14, 0], [14, 60]]}]}, **at_start(0, 14), corner_angle_deg=5)
    _, position = sampled(built(section))  # 20 mm/s, so 28.6 of the 30 mm/s2 are centripetal
    acceleration = 1e3 * np.linalg.norm(np.diff(position, 2, axis=0), axis=1) / DT**2
    assert 28.5 < acceleration.max() <= 30.0


@pytest.mark.slow
@law
@given(drawings, limits)
def test_the_speed_is_the_derivative_of_the_arc_length(strokes, limit):
    time_law = built(drawing(*strokes, **limit)).time_law
    t = np.linspace(0.0, time_law.total, 2000)
    h = 1e-5
    slope = (time_law.arc_length(t + h) - time_law.arc_length(t - h)) / (2 * h)
    assert np.allclose(slope, time_law.speed(t), atol=1e-8)


def test_a_stroke_slows_down_for_a_tight_arc_only():
    bend = {"arc": {"center": [100, 3], "radius": 3, "from_deg": -90, "to_deg": 0}}
    stroke = {"path": [{"line": [[0, 0], [100, 0]]}, bend, {"line": [[103, 3], [103, 103]]}]}
    trajectory = built(drawing(stroke, **at_start(0, 0), speed_limit_mm_s=20, corner_angle_deg=5))
    t, position = sampled(trajectory)
    speed = 1e3 * trajectory.time_law.speed(t)
    x, y = 1e3 * (position - REST)[:, :2].T
    assert speed.max() == pytest.approx(20.0)
    assert speed[(x > 100.1) & (y < 2.9)].max() <= math.sqrt(30 * 3) * (1 + 1e-9)


@pytest.mark.slow
@law
@given(drawings, st.integers(0, 359), st.integers(-89, 89))
def test_turning_the_plane_turns_the_drawing(strokes, azimuth, tilt):
    a, b = math.radians(azimuth), math.radians(tilt)
    x_axis = [math.cos(a), math.sin(a), 0.0]
    y_axis = [-math.sin(a) * math.cos(b), math.cos(a) * math.cos(b), math.sin(b)]
    flat, turned = (
        built(drawing(*strokes, plane=plane)) for plane in ({}, {"x_axis": x_axis, "y_axis": y_axis})
    )
    t = np.linspace(0.0, flat.duration, 300)
    x, y, z = (flat.position(t) - REST).T
    assert np.allclose(z, 0.0, atol=1e-12)
    assert turned.duration == pytest.approx(flat.duration)
    expected = REST + np.outer(x, x_axis) + np.outer(y, y_axis)
    assert np.allclose(turned.position(t), expected, atol=1e-9)
