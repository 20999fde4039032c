"""Laws of the trajectories that command an orientation: waypoints, revolution, scan."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from support.drawings import REST, UP, Section, built, law, parsed
from tcrctl.config.validation import check
from tcrctl.numerics.rotation import angle_between, normal_from_angles
from tcrctl.trajectory.pose_path import EndPose, StraightMove
from tcrctl.trajectory.waypoints import legs, pose_of

H = 0.02
HOME = EndPose(REST, UP)


def revolution(**keys):
    return parsed(
        {"kind": "revolution", "tilt_deg": [30, 30], "lean": "inward", "turn_s": 10, "blend_in_s": 5, **keys}
    )


def scan(**keys):
    hole = {"offset_mm": [150, 0, 170], "axis": [1, 0, 0]}
    stages = {"approach_s": 10, "tilt_s": 4, "turn_s": 16, "return_s": 4}
    return parsed({"kind": "scan", "hole": hole, "tilt_deg": 30, **stages, **keys})


def waypoints(*points, **keys):
    return parsed({"kind": "waypoints", "points": list(points), **keys})


def at(*times):
    return np.array(times, dtype=float)


def grid(trajectory, h=H):
    return np.arange(-1.0, trajectory.duration + 1.0, h)


def angles(a, b):
    return np.array([angle_between(x, y) for x, y in zip(a, b, strict=True)])


offsets = st.tuples(*[st.integers(-150, 150).map(float)] * 3)
spans = st.tuples(st.integers(0, 80).map(float), st.integers(0, 80).map(float))
signed_spans = st.tuples(st.integers(-50, 50).map(float), st.integers(-50, 50).map(float))
tilts = st.tuples(st.integers(0, 60).map(float), st.integers(0, 60).map(float))
thetas = st.tuples(st.integers(-100, 100).map(float), st.integers(-80, 80).map(float))

revolutions = st.fixed_dictionaries(
    {
        "offset_mm": offsets,
        "radius_mm": spans,
        "height_mm": signed_spans,
        "tilt_deg": tilts,
        "lean": st.sampled_from(["outward", "inward"]),
        "start_deg": st.integers(-360, 360).map(float),
        "turns": st.sampled_from([-2.0, -0.5, 0.75, 1.0, 3.0]),
        "turn_s": st.floats(6.0, 30.0),
        "ramp_s": st.floats(1.0, 3.0),
        "blend_in_s": st.floats(2.0, 12.0),
        "blend_out_s": st.sampled_from([0.0, 3.0, 8.0]),
        "dwell_s": st.sampled_from([0.0, 1.5]),
    }
).map(lambda keys: revolution(**keys))


@st.composite
def tours(draw, oriented=None):
    oriented = draw(st.booleans()) if oriented is None else oriented
    pose = {"offset_mm": offsets, **({"theta_deg": thetas} if oriented else {})}
    points = draw(st.lists(st.fixed_dictionaries(pose), min_size=1, max_size=4))
    limits = {
        "speed_limit_mm_s": draw(st.floats(5.0, 50.0)),
        "acceleration_limit_mm_s2": draw(st.floats(5.0, 80.0)),
        "angular_speed_limit_deg_s": draw(st.floats(2.0, 20.0)),
        "angular_acceleration_limit_deg_s2": draw(st.floats(2.0, 30.0)),
        "ramp_s": draw(st.floats(0.5, 3.0)),
    }
    return waypoints(*points, **limits, dwell_s=draw(st.sampled_from([0.0, 1.0])))


@st.composite
def scans(draw):
    azimuth, elevation = (math.radians(draw(st.integers(-90, 90))) for _ in range(2))
    axis = [
        math.cos(elevation) * math.cos(azimuth),
        math.cos(elevation) * math.sin(azimuth),
        -math.sin(elevation),
    ]
    return scan(
        hole={"offset_mm": draw(offsets), "axis": axis},
        tilt_deg=draw(st.integers(5, 60)),
        start_deg=draw(st.integers(-180, 180)),
        turn=draw(st.sampled_from(["clockwise", "counter_clockwise"])),
        turn_s=draw(st.floats(6.0, 30.0)),
        ramp_s=draw(st.floats(1.0, 3.0)),
    )


pose_sections = st.one_of(revolutions, scans(), tours(oriented=True))


@law
@given(st.one_of(pose_sections, tours()))
def test_it_starts_at_the_rest_pose_and_stands_still_before_and_after(section):
    trajectory = built(section)
    position = trajectory.position(at(-9.0, 0.0, trajectory.duration, 1e6))
    assert np.allclose(position[:2], REST, atol=1e-12)
    assert np.allclose(position[2], position[3], atol=1e-12)
    normal = trajectory.normal(at(-9.0, 0.0, trajectory.duration, 1e6))
    if normal is not None:
        assert np.allclose(normal[:2], UP, atol=1e-12)
        assert np.allclose(normal[2], normal[3], atol=1e-9)


@law
@given(pose_sections)
def test_normals_are_unit_vectors(section):
    trajectory = built(section)
    normal = trajectory.normal(grid(trajectory, 0.1))
    assert np.abs(np.linalg.norm(normal, axis=1) - 1.0).max() < 1e-12


@pytest.mark.slow
@law
@given(st.one_of(pose_sections, tours()))
def test_position_and_normal_are_three_times_continuously_differentiable(section):
    """A jump of the n-th derivative by J makes n-th differences jump by J, whatever the step."""
    trajectory = built(section)
    for curve in (trajectory.position, trajectory.normal):
        jumps = []
        for h in (H, 0.5 * H):
            values = curve(grid(trajectory, h))
            if values is None:
                return
            third = np.diff(values, 3, axis=0) / h**3
            jumps.append(np.abs(np.diff(third, axis=0)).max())
        # halving the step halves the largest change of a continuous third derivative with bounded slope
        assert jumps[1] <= 0.6 * jumps[0] + 1e-5


@pytest.mark.slow
@law
@given(tours())
def test_waypoints_keep_speed_acceleration_and_angular_limits(section):
    trajectory = built(section)
    t = grid(trajectory)
    velocity = 1e3 * np.diff(trajectory.position(t), axis=0) / H
    acceleration = np.diff(velocity, axis=0) / H
    assert np.linalg.norm(velocity, axis=1).max() <= section.speed_limit_mm_s * (1 + 1e-9)
    assert np.linalg.norm(acceleration, axis=1).max() <= section.acceleration_limit_mm_s2 * (1 + 1e-6)
    normal = trajectory.normal(t)
    if normal is not None:
        rate = np.degrees(angles(normal[:-1], normal[1:])) / H
        assert rate.max() <= section.angular_speed_limit_deg_s * (1 + 1e-6)
        assert (
            np.abs(np.diff(rate)).max() / H <= section.angular_acceleration_limit_deg_s2 * (1 + 1e-3) + 1e-3
        )


@law
@given(tours(oriented=True))
def test_a_leg_is_straight_and_turns_the_normal_by_the_smallest_angle(section):
    for move in legs(section, HOME):
        if move.curve is None:
            continue
        assert isinstance(move.curve, StraightMove)
        x = np.linspace(0.0, 1.0, 60)
        position, normal = move.curve.position(x), move.curve.normal(x)
        travelled = np.linalg.norm(np.diff(position, axis=0), axis=1).sum()
        assert travelled == pytest.approx(move.curve.length, abs=1e-12)
        turned = angles(normal[:-1], normal[1:]).sum()
        assert turned == pytest.approx(angle_between(normal[0], normal[-1]), abs=1e-9)


@pytest.mark.slow
@law
@given(tours())
def test_every_waypoint_is_reached_and_held_for_its_dwell(section):
    trajectory = built(section)
    begun, found = 0.0, []
    for move in legs(section, HOME):
        begun += sum(phase.duration for phase in move.phases)
        if move.curve is not None:
            found.append(begun)
    assert trajectory.duration == pytest.approx(begun)
    for time, point in zip(found, section.points, strict=True):
        wanted = pose_of(point, REST)
        held = at(time, time + section.dwell_s)
        assert np.allclose(trajectory.position(held), wanted.position, atol=1e-9)
        if wanted.normal is not None:
            assert np.allclose(trajectory.normal(held), wanted.normal, atol=1e-7)


def test_a_place_can_be_given_in_the_world_and_a_normal_as_a_vector():
    angle = math.radians(20)
    section = waypoints({"position_mm": [10, 20, -550], "normal": [-math.sin(angle), 0, math.cos(angle)]})
    trajectory = built(section)
    end = at(trajectory.duration)
    assert np.allclose(trajectory.position(end), [0.010, 0.020, -0.550], atol=1e-12)
    assert np.allclose(trajectory.normal(end), normal_from_angles(0.0, -angle), atol=1e-12)


def test_a_waypoint_at_the_rest_pose_is_a_rest():
    trajectory = built(waypoints({"offset_mm": [0, 0, 0], "theta_deg": [0, 0]}))
    t = grid(trajectory)
    assert np.allclose(trajectory.position(t), REST, atol=1e-15)
    assert np.allclose(trajectory.normal(t), UP, atol=1e-15)


@pytest.mark.slow
@law
@given(revolutions)
def test_a_revolution_runs_from_its_first_to_its_last_radius_height_and_tilt(section):
    trajectory = built(section)
    turning = abs(section.turns) * section.turn_s + section.ramp_s
    begin = section.lead_in_s + section.blend_in_s + section.dwell_s
    rests = section.dwell_s + section.settle_s
    assert trajectory.duration == pytest.approx(begin + turning + rests + section.blend_out_s)
    t = np.linspace(begin, begin + turning, 400)
    spoke = 1e3 * (trajectory.position(t) - REST) - section.offset_mm
    normal = trajectory.normal(t)
    ends = [0, -1]
    assert np.allclose(np.hypot(spoke[:, 0], spoke[:, 1])[ends], section.radius_mm, atol=1e-6)
    assert np.allclose(spoke[ends, 2], section.height_mm, atol=1e-6)
    assert np.allclose(np.degrees(np.arccos(normal[ends, 2])), section.tilt_deg, atol=1e-4)
    assume(min(section.radius_mm) > 0.0)
    angle = np.unwrap(np.arctan2(spoke[:, 1], spoke[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(2.0 * math.pi * section.turns, abs=1e-6)
    outward = np.sum(spoke[:, :2] * normal[:, :2], axis=1)
    assert np.all(outward * (1.0 if section.lean == "outward" else -1.0) >= -1e-9)
    # all three change in proportion to the angle turned
    part = (angle - angle[0]) / (angle[-1] - angle[0])
    for value, (first, last) in (
        (np.hypot(spoke[:, 0], spoke[:, 1]), section.radius_mm),
        (spoke[:, 2], section.height_mm),
    ):
        assert np.allclose(value, first + part * (last - first), atol=1e-6)


@law
@given(revolutions)
def test_a_full_turn_at_full_speed_takes_the_time_asked_for(section):
    trajectory = built(section)
    begin = section.lead_in_s + section.blend_in_s + section.dwell_s
    t = begin + section.ramp_s + np.linspace(0.0, abs(section.turns) * section.turn_s - section.ramp_s, 50)
    assume(t[-1] > t[0] and min(section.radius_mm) > 1.0)
    spoke = trajectory.position(t) - REST - 1e-3 * np.array(section.offset_mm)
    angle = np.unwrap(np.arctan2(spoke[:, 1], spoke[:, 0]))
    rate = np.diff(angle) / np.diff(t)
    assert np.allclose(np.abs(rate), 2.0 * math.pi / section.turn_s, rtol=1e-6)


def test_radius_zero_turns_about_a_fixed_point_with_a_constant_tilt():
    section = revolution(offset_mm=[5, -3, 30], tilt_deg=[35, 35], blend_out_s=5)
    trajectory = built(section)
    t = np.linspace(6.0 + 1.0, 6.0 + 1.0 + 13.0, 300)
    assert np.allclose(trajectory.position(t), REST + np.array([0.005, -0.003, 0.030]), atol=1e-15)
    assert np.allclose(trajectory.normal(t)[:, 2], math.cos(math.radians(35)), atol=1e-12)
    home = at(trajectory.duration)
    assert np.allclose(trajectory.position(home), REST, atol=1e-12)
    assert np.allclose(trajectory.normal(home), UP, atol=1e-12)


@law
@given(scans())
def test_a_scan_stays_at_the_hole_and_turns_once_at_its_tilt(section):
    trajectory = built(section)
    place = REST + 1e-3 * np.array(section.hole.offset_mm)
    against = -np.array(section.hole.axis)
    stages = np.cumsum(
        [section.lead_in_s, section.approach_s, section.tilt_s, section.turn_s, section.return_s]
    )
    assert trajectory.duration == pytest.approx(stages[-1] + section.settle_s)
    at_hole = np.linspace(stages[1], trajectory.duration, 200)
    assert np.allclose(trajectory.position(at_hole), place, atol=1e-12)
    assert angle_between(trajectory.normal(at(stages[1]))[0], against) < 1e-7
    assert angle_between(trajectory.normal(at(trajectory.duration))[0], against) < 1e-7
    t = np.linspace(stages[2], stages[3], 400)
    normal = trajectory.normal(t)
    tilt = angles(normal, np.tile(against / np.linalg.norm(against), (t.size, 1)))
    assert np.allclose(np.degrees(tilt), section.tilt_deg, atol=1e-6)
    # the tip of the normal goes once round a circle, in the sense asked for
    steps = np.cross(normal[:-1], normal[1:]) @ against
    assert np.all(steps * (1.0 if section.turn == "counter_clockwise" else -1.0) >= -1e-12)
    radius = math.sin(math.radians(section.tilt_deg))
    around = np.linalg.norm(np.diff(normal, axis=0), axis=1).sum()
    assert around == pytest.approx(2.0 * math.pi * radius, rel=1e-3)


@pytest.mark.parametrize(("start_deg", "upward"), [(0, 1.0), (180, -1.0)])
def test_a_scan_tilts_straight_up_first_at_angle_zero(start_deg, upward):
    trajectory = built(scan(start_deg=start_deg))
    normal = trajectory.normal(at(14.0))[0]
    half = math.radians(30)
    assert np.allclose(normal, [-math.cos(half), 0.0, upward * math.sin(half)], atol=1e-12)


def test_a_scan_through_a_hole_that_looks_down_tilts_along_x_first():
    trajectory = built(scan(hole={"offset_mm": [0, 0, 30], "axis": [0, 0, -1]}, tilt_deg=20))
    normal = trajectory.normal(at(14.0))[0]
    assert np.allclose(normal, [math.sin(math.radians(20)), 0.0, math.cos(math.radians(20))], atol=1e-12)


@pytest.mark.slow
@law
@given(st.one_of(pose_sections, tours()))
def test_many_times_at_once_are_as_good_as_one_by_one(section):
    trajectory = built(section)
    t = np.linspace(-1.0, trajectory.duration + 1.0, 23)[::-1]
    for curve in (trajectory.position, trajectory.normal):
        together = curve(t)
        if together is not None:
            assert np.array_equal(together, np.concatenate([curve(at(time)) for time in t]))


GOOD = {
    "waypoints": {"kind": "waypoints", "points": [{"offset_mm": [1, 2, 3]}]},
    "revolution": {"kind": "revolution", "tilt_deg": [5, 5], "lean": "outward", "turn_s": 9, "blend_in_s": 3},
    "scan": {
        "kind": "scan",
        "hole": {"position_mm": [1, 2, -3], "axis": [0, 1, 0]},
        "tilt_deg": 20,
        "approach_s": 5,
        "tilt_s": 5,
        "turn_s": 10,
        "return_s": 5,
    },
}


@pytest.mark.parametrize(
    ("kind", "change", "said"),
    [
        ("waypoints", {"points": []}, "at least 1 item"),
        ("waypoints", {"points": [{}]}, "exactly one of offset_mm, position_mm, target; given: none"),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 0], "position_mm": [0, 0, 0]}]},
            "given: offset_mm, position_mm",
        ),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 0], "normal": [0, 0, 1], "theta_deg": [0, 0]}]},
            "at most one of normal, theta_deg",
        ),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 0], "normal": [0, 0, 2]}]},
            "must have length 1, it has 2",
        ),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 0], "theta_deg": [0, 91]}]},
            "theta_y must be within -90 and 90",
        ),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 1]}, {"offset_mm": [0, 0, 2], "theta_deg": [0, 0]}]},
            "waypoint 2 has an orientation, but waypoint 1 has none",
        ),
        (
            "waypoints",
            {"points": [{"offset_mm": [0, 0, 2], "theta_deg": [0, 0]}, {"offset_mm": [0, 0, 1]}]},
            "waypoint 2 has no orientation, but waypoint 1 has one",
        ),
        ("waypoints", {"ramp_s": 0}, "> 0"),
        ("revolution", {"radius_mm": [-1, 5]}, "must be >= 0, not -1"),
        ("revolution", {"tilt_deg": [-5, 5]}, "within 0 and 180"),
        ("revolution", {"ramp_s": 10}, "ramp_s, 10, must be at most turns * turn_s, 9"),
        ("revolution", {"turns": 0}, "ramp_s, 3, must be at most turns * turn_s, 0"),
        ("revolution", {"lean": "left"}, "'outward' or 'inward'"),
        ("scan", {"ramp_s": 6}, "ramp_s must be at most half of turn_s, 5, not 6"),
        ("scan", {"tilt_deg": 90}, "< 90"),
        ("scan", {"hole": {"position_mm": [1, 2, -3], "axis": [1, 1, 0]}}, "must have length 1"),
    ],
)
def test_what_cannot_be_followed_is_said(kind, change, said):
    assert check(GOOD[kind], Section)[1] == []
    _, problems = check({**GOOD[kind], **change}, Section)
    assert len(problems) == 1
    assert said in problems[0][1]
