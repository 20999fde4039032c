import cmath
import itertools
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import RootModel

from tcrctl import strict_yaml
from tcrctl.trajectory.corner import rounding
from tcrctl.trajectory.plane_curve import PlanePiece, turn_angle
from tcrctl.trajectory.settings import TrajectorySettings
from tcrctl.trajectory.strokes import moves
from tcrctl.trajectory.trajectory import build_trajectory, sample_reference
from tcrctl.validation import check

REST = np.array([0.004, -0.003, -0.6])
UP = np.array([0.0, 0.0, 1.0])
DT = 0.005
LETTERS = ["letter_i", "heart", "letter_d", "letter_u", "letter_t"]
EXPERIMENTS = Path(__file__).parents[1] / "experiments"


class Section(RootModel[TrajectorySettings]):
    pass


law = settings(deadline=None, max_examples=40)


def parsed(section):
    return Section.model_validate_json(json.dumps(section)).root


def drawing(*strokes, **keys):
    return parsed({"kind": "strokes", "strokes": list(strokes), "corner_angle_deg": 0, **keys})


def built(section):
    return build_trajectory(section, REST, UP)


def at_start(x, y, **keys):
    """Keys that put the drawing's first point (x, y) on the rest position: no approach."""
    return {"plane": {"offset_mm": [-x, -y, 0]}, "lead_in_s": 0.0, **keys}


def sampled(trajectory, dt=DT):
    t = np.arange(0.0, trajectory.duration + dt, dt)
    return t, trajectory.position(t)


def in_plane_mm(position, section):
    return 1e3 * (position - REST) - np.array(section.plane.offset_mm)


coordinates = st.integers(-60, 60).map(float)
points = st.tuples(coordinates, coordinates)


@st.composite
def polylines(draw):
    line = draw(st.lists(points, min_size=2, max_size=6))
    assume(all(a != b for a, b in itertools.pairwise(line)))
    return {"line": line}


@st.composite
def arcs(draw):
    start = draw(st.integers(-360, 360))
    sweep = draw(st.integers(5, 500)) * draw(st.sampled_from([-1, 1]))
    radius = draw(st.integers(1, 60))
    return {"arc": {"center": draw(points), "radius": radius, "from_deg": start, "to_deg": start + sweep}}


@st.composite
def tangent_paths(draw):
    """A line into an arc into a line, without corners, somewhere on the sheet."""
    heading, radius = draw(st.integers(0, 359)), draw(st.integers(2, 50))
    left, sweep = draw(st.sampled_from([-1, 1])), draw(st.integers(10, 300))
    first, last = draw(st.integers(1, 60)), draw(st.integers(1, 60))
    before = cmath.exp(1j * math.radians(heading))
    after = before * cmath.exp(1j * math.radians(left * sweep))
    centre = left * 1j * before * radius
    end = centre - left * 1j * after * radius
    arc_from = heading - left * 90
    return {
        "path": [
            {"line": [pair(-first * before), [0, 0]]},
            {
                "arc": {
                    "center": pair(centre),
                    "radius": radius,
                    "from_deg": arc_from,
                    "to_deg": arc_from + left * sweep,
                }
            },
            {"line": [pair(end), pair(end + last * after)]},
        ]
    }


def pair(z):
    return [z.real, z.imag]


limits = st.fixed_dictionaries(
    {
        "speed_limit_mm_s": st.floats(1.0, 60.0),
        "travel_speed_limit_mm_s": st.floats(5.0, 60.0),
        "acceleration_limit_mm_s2": st.floats(5.0, 100.0),
        "ramp_s": st.floats(0.2, 2.0),
    }
)
drawings = st.lists(st.one_of(polylines(), arcs(), tangent_paths()), min_size=1, max_size=2)


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


@law
@given(drawings, limits)
def test_the_duration_is_that_of_all_moves_and_rests(strokes, limit):
    section = drawing(*strokes, **limit, lead_in_s=1.5, dwell_s=0.25, settle_s=2.0)
    plan = list(moves(section, REST))
    moving = sum(p.duration for move in plan if move.pieces for p in move.phases)
    assert built(section).duration == pytest.approx(moving + 1.5 + 0.25 * len(strokes) + 2.0)


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


def to_edge(position, a, b):
    along = np.clip((position - a) @ (b - a) / np.dot(b - a, b - a), 0.0, 1.0)
    return np.linalg.norm(position - a - along[:, None] * (b - a), axis=1)


@law
@given(polylines(), limits)
def test_acceleration_is_continuous_on_straight_moves(stroke, limit):
    _, position = sampled(built(drawing(stroke, **limit)))
    acceleration = 1e3 * np.diff(position, 2, axis=0) / DT**2
    top = max(limit["speed_limit_mm_s"], limit["travel_speed_limit_mm_s"])
    jerk = 10.0 / math.sqrt(3.0) * top / limit["ramp_s"] ** 2  # largest R'' of the ramp polynomial
    assert np.linalg.norm(np.diff(acceleration, axis=0), axis=1).max() <= jerk * DT * (1 + 1e-6) + 1e-6


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


@pytest.mark.parametrize("name", LETTERS)
def test_each_letter_is_drawn_in_its_plane_inside_the_workspace(name):
    section, problems = check(strict_yaml.load(EXPERIMENTS / f"{name}.yaml").data["trajectory"], Section)
    assert problems == []
    trajectory = built(section.root)
    assert 30.0 <= trajectory.duration <= 60.0
    _, position = sampled(trajectory)
    drawn = in_plane_mm(position, section.root)
    assert np.hypot(drawn[:, 0], drawn[:, 1]).max() <= 50.0 + 1e-6
    on_paper = drawn[np.abs(drawn[:, 2]) < 1e-6]
    height = on_paper[:, 1].max() - on_paper[:, 1].min()
    assert 75.0 <= height <= 100.0
    for stroke in section.root.strokes:
        for segment in stroke.segments:
            for corner in segment.line or segment.ends:
                assert np.linalg.norm(on_paper[:, :2] - corner, axis=1).min() < 10 * DT


def test_the_sides_of_the_heart_touch_its_arcs_without_a_corner():
    section, _ = check(strict_yaml.load(EXPERIMENTS / "heart.yaml").data["trajectory"], Section)
    runs = [move for move in moves(section.root, REST) if move.pieces]
    # approach, tip to cusp, cusp to tip
    assert [len(move.pieces) for move in runs] == [1, 2, 2]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"strokes": []}, "at least 1 item"),
        ({"strokes": [{}]}, "exactly one of line, arc, path; given: none"),
        ({"strokes": [{"line": [[0, 0]]}]}, "at least 2 points"),
        ({"strokes": [{"line": [[0, 0], [1, 1], [1, 1]]}]}, "points 2 and 3 are the same"),
        ({"strokes": [{"path": []}]}, "at least 1 item"),
        (
            {"strokes": [{"path": [{"line": [[0, 0], [1, 0]]}, {"line": [[1, 2e-6], [2, 0]]}]}]},
            "segment 2 starts at",
        ),
        ({"strokes": [{"arc": {"center": [0, 0], "radius": 0, "from_deg": 0, "to_deg": 9}}]}, "> 0"),
        ({"strokes": [{"arc": {"center": [0, 0], "radius": 1, "from_deg": 9, "to_deg": 9}}]}, "no length"),
        ({"speed_limit_mm_s": 0}, "> 0"),
        ({"ramp_s": -1}, "> 0"),
        ({"speed_limit": 3}, "unknown key"),
        ({"corner": "cut"}, "'stop' or 'round'"),
        ({"plane": {"x_axis": [1, 0, 0.1]}}, "must have length 1"),
        ({"plane": {"y_axis": [1, 0, 0]}}, "perpendicular"),
        ({"kind": "stroke"}, "'strokes', 'hold'"),
    ],
)
def test_what_cannot_be_drawn_is_said(change, said):
    good = {"kind": "strokes", "strokes": [{"line": [[0, 0], [1, 0]]}]}
    assert check(good, Section)[1] == []
    _, problems = check({**good, **change}, Section)
    assert len(problems) == 1
    assert said in problems[0][1]


@pytest.mark.parametrize("end", [[100, 0], [0, 100], [60, 80], [-60, 80]])
def test_rounded_axes_are_made_orthonormal(end):
    plane = {"x_axis": [0.7071, 0.7071, 0.0], "y_axis": [-0.7076, 0.7066, 0.0]}
    trajectory = built(drawing({"line": [[0, 0], end]}, plane=plane))
    reached = trajectory.position(np.array([trajectory.duration]))[0]
    assert np.linalg.norm(reached - REST) == pytest.approx(0.1, rel=1e-12)


@pytest.mark.parametrize("orientation", ["free", "rest"])
def test_hold_stands_still_at_its_offset_for_its_duration(orientation):
    section = parsed({"kind": "hold", "duration_s": 4, "offset_mm": [5, 0, 10], "orientation": orientation})
    trajectory = built(section)
    t = np.array([-1.0, 0.0, 2.0, 9.0])
    assert trajectory.duration == 4.0
    assert np.allclose(trajectory.position(t), REST + np.array([0.005, 0.0, 0.010]), atol=1e-15)
    normal = trajectory.normal(t)
    assert normal is None if orientation == "free" else np.array_equal(normal, np.tile(UP, (4, 1)))


@pytest.mark.parametrize(
    "section",
    [
        {"kind": "hold", "duration_s": 1, "orientation": "rest"},
        {"kind": "strokes", "strokes": [{"line": [[0, 0], [50, 0]]}]},
    ],
)
def test_a_reference_holds_the_target_now_and_ahead(section):
    trajectory = built(parsed(section))
    ahead = np.array([2.1, 2.4, 99.0])
    reference = sample_reference(trajectory, 2.0, ahead)
    assert reference.t == 2.0
    assert np.array_equal(reference.position, trajectory.position(np.array([2.0]))[0])
    assert np.array_equal(reference.ahead_position, trajectory.position(ahead))
    assert (reference.normal is None) == (reference.ahead_normal is None) == (section["kind"] == "strokes")


def test_reading_settings_needs_no_numerical_library():
    heavy = "{'numpy', 'scipy', 'numba'} & set(sys.modules)"
    program = f"import sys, tcrctl.trajectory.settings; print({heavy} or 'none')"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "none"
