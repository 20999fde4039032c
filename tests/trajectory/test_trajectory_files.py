from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from support.drawings import (
    DT,
    EXPERIMENTS,
    LETTERS,
    REST,
    UP,
    Section,
    built,
    drawing,
    in_plane_mm,
    parsed,
    sampled,
)
from tcrctl.config import strict_yaml
from tcrctl.config.validation import check
from tcrctl.trajectory.strokes import moves
from tcrctl.trajectory.trajectory import sample_reference


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


@pytest.mark.slow
def test_reading_settings_needs_no_numerical_library():
    heavy = "{'numpy', 'scipy', 'numba'} & set(sys.modules)"
    program = f"import sys, tcrctl.trajectory.settings; print({heavy} or 'none')"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "none"
