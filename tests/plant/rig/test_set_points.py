"""Set-points: integrated without drift, and inside every limit whatever is asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.rig_fakes import HIGH, LOW, PERIOD, STEP, M, envelope
from tcrctl.plant.rig.set_points import SetPoints

GROUP_LOW, GROUP_HIGH = -15_000, 60_000
SPEEDS = st.lists(
    st.floats(allow_nan=True, allow_infinity=True) | st.floats(-0.2, 0.2), min_size=M, max_size=M
)
TAKEN = st.sampled_from(["accept", "lost", "refused"])


def started(*start, **changes):
    return SetPoints(envelope(**changes), PERIOD, start or (0, 0, 0))


@given(st.lists(st.tuples(SPEEDS, TAKEN), max_size=60))
def test_no_command_leaves_the_limits_or_makes_a_step_too_large(commands):
    points = started()
    on_the_plc = points.accepted
    for speed, fate in commands:
        target, _ = points.propose(np.array(speed))
        assert np.all((target >= LOW) & (target <= HIGH))
        assert GROUP_LOW <= target.sum() <= GROUP_HIGH
        assert np.all(np.abs(target - on_the_plc) <= STEP)
        if fate == "lost":
            points.start_again()
            continue
        points.accept()
        if fate == "refused":
            points.take_back()
        else:
            on_the_plc = target
    assert points.accepted.dtype == np.int64


@given(st.lists(st.floats(-1e-5, 1e-5), min_size=1, max_size=400))
def test_slow_motion_does_not_drift_by_rounding(speeds):
    """At 20 Hz a speed of 10 um/s is half a micrometre per step."""
    points, exact = started(10_000, 10_000, 10_000), 10_000.0
    for speed in speeds:
        points.propose(np.full(M, speed))
        points.accept()
        exact += 1e6 * PERIOD * speed
    assert np.all(np.abs(points.accepted - exact) <= 0.5 + 1e-6)


def test_a_start_outside_the_stroke_can_only_move_inwards():
    points = started(HIGH + 2000, 0, 0, groups=())
    outward, clamps = points.propose(np.array([0.02, 0.0, 0.0]))
    assert outward[0] == HIGH + 2000
    assert [clamp.rule for clamp in clamps] == ["stroke limit"]
    inward, clamps = points.propose(np.array([-0.02, 0.0, 0.0]))
    assert (inward[0], clamps) == (HIGH + 1000, ())
    points.accept()
    assert points.propose(np.array([0.02, 0.0, 0.0]))[0][0] == HIGH + 1000


@pytest.mark.parametrize(
    ("speed", "changes", "rule", "wanted", "sent", "unit"),
    [
        (0.08, {}, "speed limit", 80.0, 50.0, "mm/s"),
        (-0.08, {}, "speed limit", -80.0, -50.0, "mm/s"),
        (0.04, {"acceleration": np.full(M, 200_000.0)}, "acceleration limit", 40.0, 10.0, "mm/s"),
        (0.04, {"change": np.full(M, 1500)}, "step limit", 2.0, 1.5, "mm"),
        (0.04, {"high": np.full(M, 900)}, "stroke limit", 2.0, 0.9, "mm"),
        (np.inf, {}, "not a finite number", np.inf, 0.0, "mm/s"),
    ],
)
def test_every_clamp_says_what_was_wanted_and_what_is_sent(speed, changes, rule, wanted, sent, unit):
    points = started(**changes)
    _, (clamp,) = points.propose(np.array([0.0, speed, 0.0]))
    assert (clamp.cable, clamp.rule, clamp.unit) == ("c2", rule, unit)
    assert (clamp.wanted, clamp.sent) == pytest.approx((wanted, sent))
    assert "c2" in str(clamp)
    assert unit in str(clamp)


def test_antagonists_that_pull_against_each_other_are_held_together():
    points = started(19_000, 19_000, 21_000)
    target, (clamp,) = points.propose(np.array([0.02, 0.02, 0.0]))
    assert target.tolist() == [19_000, 19_000, 21_000]
    assert (clamp.rule, clamp.wanted, clamp.sent) == ("sum of antagonists", 61.0, 59.0)
    turned, clamps = points.propose(np.array([0.02, 0.0, -0.02]))
    assert (turned.tolist(), clamps) == ([20_000, 19_000, 20_000], ())


def test_what_was_lost_or_refused_is_not_built_upon():
    points = started()
    points.propose(np.full(M, 0.02))
    points.start_again()
    assert points.propose(np.full(M, 0.02))[0].tolist() == [1000] * M
    points.accept()
    points.propose(np.full(M, 0.02))
    points.accept()
    points.take_back()
    assert points.accepted.tolist() == [1000] * M
    assert points.propose(np.full(M, 0.02))[0].tolist() == [2000] * M
