"""The picture judged in motion: what a robot cannot do is left out and said once; too much of it stops the run."""

from __future__ import annotations

import numpy as np
import pytest

from support import pictures
from support.pictures import (
    PERIOD,
    RINGS,
    STILL,
    exchanged,
    frames,
    judged,
    labels_moved,
    mirrored,
    rows_of,
    shifted,
    turned,
)
from tcrctl.picture.kernel import Shape
from tcrctl.picture.limits import limits_in_motion
from tcrctl.picture.settings import PictureSettings
from tcrctl.picture.shares import joint_shares

BEGIN = 200
"""Frame in which something goes wrong."""
SPEED = 0.5
"""Of what drifts [mm/s]."""


def wrong_from(distort, seed=1, **made):
    """Frames of which those from BEGIN on are distorted."""
    return [distort(frame) if k >= BEGIN else frame for k, frame in enumerate(frames(seed, **made))]


def drifting(rows, way, seed=1, begin=BEGIN):
    """Frames in which some markers drift."""
    way = SPEED * np.array(way) / np.linalg.norm(way)
    return [shifted(m, rows, way * PERIOD * max(0, k - begin)) for k, m in enumerate(frames(seed))]


def noticed_mm(found, begin=BEGIN):
    """What had drifted when something was left out first [mm]; infinite if nothing was."""
    return np.inf if found.first is None else SPEED * PERIOD * (found.first + STILL - begin)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "made"),
    [
        (1, {}),
        (2, {"bias_mm": 4.0}),
        (3, {"bias_mm": 4.0, "lost": 0.1}),
        (4, {"lost": 0.5}),
        (5, {"noise": 300e-6}),
        (6, {"noise": 0.0, "bias_mm": 0.0}),
    ],
)
def test_a_healthy_picture_passes_as_it_is(seed, made):
    found = judged(frames(seed, **made))
    assert (found.first, found.stopped, found.events) == (None, None, [])
    assert not any(found.doubts)


def test_without_judgement_there_is_no_threshold_that_the_film_does_not_reach():
    """The film itself is no easy one: with a tenth of the limits it is not believed."""
    assert judged(frames(1), joint_mm=0.2, frame_mm=0.2).first is not None


FRAMES = {
    "turned by 20 deg": lambda m: turned(m, 0, 0, 20),
    "turned by 90 deg": lambda m: turned(m, 0, 0, 90),
    "turned by 10 deg": lambda m: turned(m, 0, 0, -10),
    "tilted by 20 deg": lambda m: turned(m, 20, 0, 0),
    "tilted by 5 deg": lambda m: turned(m, 3, -4, 0),
    "upside down": lambda m: turned(m, 180, 0, 0),
    "shifted": lambda m: shifted(m, slice(None), (5, 0, 0)),
    "mirrored in x": lambda m: mirrored(m, 0),
    "mirrored in y": lambda m: mirrored(m, 1),
    "mirrored in z": lambda m: mirrored(m, 2),
    "in other units": lambda m: pictures.moved(m, 1.2 * m.nodes),
    "all labels moved on": lambda m: pictures.relabelled(
        m, np.roll(np.arange(3 * RINGS).reshape(RINGS, 3), 1, 1).ravel()
    ),
    "all rings in reverse order": lambda m: pictures.relabelled(
        m, np.arange(3 * RINGS).reshape(RINGS, 3)[::-1].ravel()
    ),
}


@pytest.mark.parametrize("name", FRAMES)
def test_a_frame_that_is_wrong_all_at_once_holds_the_drives_at_once_and_then_stops_the_run(name):
    found = judged(wrong_from(FRAMES[name]))
    assert found.first == BEGIN - STILL
    assert all(found.doubts[found.first :])
    assert found.stopped is not None
    assert 0.2 < PERIOD * (found.stopped - found.first + 1) <= 0.2 + 2 * PERIOD
    told = [text for _, level, text in found.events if level == "warning"]
    assert sum(text.startswith("the drives are held") for text in told) == 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rate", [(0, 0, 2), (1, 0, 0), (0, -1, 0)])
def test_a_frame_that_turns_slowly_is_not_believed_before_the_end_is_far_off(rate, seed):
    """The first ring tells it: its joint is stiff against twist, and its place against the base hardly changes."""
    turning = [turned(m, *(np.array(rate) * PERIOD * max(0, k - BEGIN))) for k, m in enumerate(frames(seed))]
    found = judged(turning)
    angle = float(np.linalg.norm(rate)) * PERIOD * (found.first + STILL - BEGIN)
    assert angle < (8.0 if rate[2] else 3.5)
    assert found.stopped is not None
    assert found.names[0] == "the frame of the cameras"


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [(4, 7), (1, 2), (10, 11), (1, 11), (5, 6)])
def test_swapped_rings_are_left_out(first, second):
    found = judged(wrong_from(lambda m: exchanged(m, first, second)))
    swapped = rows_of(first) + rows_of(second)
    for out, doubt in zip(found.out[BEGIN - STILL :], found.doubts[BEGIN - STILL :], strict=True):
        assert out[swapped].all() or doubt
    assert not any(out.any() for out in found.out[: BEGIN - STILL])


@pytest.mark.slow
@pytest.mark.parametrize(("ring", "by"), [(5, 1), (2, 2), (RINGS, 1), (RINGS, 2)])
def test_a_ring_whose_labels_have_moved_on_is_left_out_alone(ring, by):
    found = judged(wrong_from(lambda m: labels_moved(m, ring, by)))
    for out in found.out[BEGIN - STILL :]:
        assert np.flatnonzero(out).tolist() == rows_of(ring)
    assert found.names == [f"ring {ring}"]
    assert found.stopped is None


WAYS = [(1, 0, 0), (0, 1, 0), (0, -1, 0), (-1, 1, 0), (0, 0, 1), (0, 0, -1), (1, 1, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("ring", [RINGS, 6, 3])
@pytest.mark.parametrize("way", WAYS)
def test_a_ring_that_drifts_is_left_out_before_it_is_far_off(ring, way):
    found = judged(drifting(rows_of(ring), way))
    sideways, along = bool(way[0] or way[1]), bool(way[2])  # along the body the joints' own give hides more
    assert noticed_mm(found) <= (3.0 if not along else 3.5 if sideways else 4.5)
    assert found.names[0] == f"ring {ring}"
    assert set(rows_of(ring)) <= set(np.flatnonzero(found.out[-1]))
    assert found.stopped is None


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, 16, 31, 32])
@pytest.mark.parametrize("way", [(1, 0, 0), (0, 1, 0), (-1, 1, 0)])
def test_a_marker_that_drifts_is_left_out_before_it_is_far_off(row, way):
    found = judged(drifting([row], way))
    assert noticed_mm(found) <= 2.5
    assert found.out[-1][row]
    assert np.flatnonzero(found.out[-1]).size <= 3
    assert found.stopped is None


@pytest.mark.slow
@pytest.mark.parametrize("row", [4, 16, 25])
def test_a_marker_that_drifts_out_of_the_plane_of_its_ring_tilts_it_and_is_left_out_too(row):
    found = judged(drifting([row], (0, 0, 1)))
    assert noticed_mm(found) <= 3.0


def test_what_nobody_can_tell_is_not_pretended_to_be_told():
    """A marker of the end ring that rises out of its plane tilts the ring as a bend of the last joint would."""
    rising = []
    for k, m in enumerate(frames(1)):
        ring = m.nodes[-3:].astype(float)
        normal = np.cross(ring[1] - ring[0], ring[2] - ring[0])
        way = SPEED * normal / np.linalg.norm(normal)
        rising.append(shifted(m, [32], way * PERIOD * max(0, k - BEGIN)))
    assert noticed_mm(judged(rising)) > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("size", [4.0, 10.0, 40.0])
def test_an_outlier_is_left_out_in_its_frame_only(size):
    made = frames(1)
    for k in (150, 230, 310):
        made[k] = shifted(made[k], [16], (0.0, size, 0.0))
    found = judged(made)
    assert [k + STILL for k, out in enumerate(found.out) if out.any()] == [150, 230, 310]
    assert all(16 in np.flatnonzero(found.out[k - STILL]) for k in (150, 230, 310))


def test_what_comes_back_is_believed_again_after_it_has_been_well_for_a_while():
    made = frames(1)
    for k in range(150, 200):
        made[k] = labels_moved(made[k], 5)
    found = judged(made)
    assert [(kind, level) for kind, level, _ in found.events] == [("picture", "warning"), ("picture", "info")]
    assert found.events[1][2] == "ring 5 is believed again"
    assert [k + STILL for k, out in enumerate(found.out) if out.any()] == list(range(150, 200))


def test_drives_that_were_held_for_a_moment_go_on():
    made = frames(1)
    for k in range(150, 153):
        made[k] = turned(made[k], 0, 0, 20)
    found = judged(made)
    assert [k + STILL for k, doubt in enumerate(found.doubts) if doubt] == [150, 151, 152]
    assert found.stopped is None
    assert "the drives are not held any more" in [text for _, level, text in found.events if level == "info"]


FIRST = BEGIN - STILL
"""Step in which something goes wrong."""


def stalled(after):
    """Times of steps [s] if the process was stopped for 3 s after one of them."""
    return lambda k: PERIOD * k + np.where(k > after, 3.0, 0.0)


@pytest.mark.parametrize(
    ("begun", "held"),
    [
        (lambda k: PERIOD * k, 0.2),
        (stalled(FIRST), 3.0 + PERIOD),
        (stalled(FIRST - 1), 0.2),  # before there was a doubt
        (lambda k: PERIOD * k + np.where(k > FIRST + 2, 0.06, 0.0), 0.21),  # one step took long
        (lambda k: 2.0 * PERIOD * k, 0.2),  # every step does
        (lambda k: PERIOD * k + 0.004 * np.sin(k), 0.2),  # steps begin a little early or late, that is all
    ],
)
def test_a_run_is_stopped_by_the_time_for_which_the_drives_were_held_not_by_the_number_of_steps(begun, held):
    made = wrong_from(lambda m: turned(m, 0, 0, 20))
    times = begun(np.arange(len(made)))
    found = judged(made, times)
    assert times[found.stopped] - times[found.first] == pytest.approx(held, abs=0.01)


@pytest.mark.parametrize("slow", [1.0, 2.0, 4.0])
def test_what_comes_back_has_been_well_for_a_while_by_the_clock(slow):
    made = frames(1)
    made[BEGIN] = labels_moved(made[BEGIN], 5)
    found = judged(made, slow * PERIOD * np.arange(len(made)))
    ill, well = found.told
    assert slow * PERIOD * (well - ill) == pytest.approx(1.0, abs=1.01 * slow * PERIOD)


def test_a_blank_frame_is_nothing_to_judge():
    made = frames(1)
    for k in range(100, 160):
        made[k] = pictures.moved(made[k], made[k].nodes, np.zeros(3 * RINGS, np.bool_))
    found = judged(made)
    assert (found.first, found.stopped) == (None, None)


def test_a_ring_that_is_seen_for_the_first_time_in_motion_is_believed_as_it_is():
    made = frames(1)
    hidden = np.ones(3 * RINGS, np.bool_)
    hidden[rows_of(6)] = False
    made[:100] = [pictures.moved(m, m.nodes, hidden) for m in made[:100]]
    assert judged(made).first is None
    drifted = [shifted(m, rows_of(6), (0.025 * max(0, k - 200), 0, 0)) for k, m in enumerate(made)]
    assert judged(drifted).names[0] == "ring 6"


@pytest.mark.parametrize(("ring", "unseen"), [(10, 11), (7, 8), (7, 6), (2, 1)])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_joint_beside_one_that_is_not_seen_gives_no_more_along_the_body_than_a_joint_can(ring, unseen, way):
    """As with two rings exchanged, once one of them is left out."""
    offset = np.zeros((RINGS, 3))
    offset[unseen - 1] = np.nan
    offset[ring - 1, 2] = way

    def share(millimetres):
        change = Shape(
            np.zeros((RINGS, 3)), 1e-3 * millimetres * offset, np.zeros(RINGS), np.zeros((RINGS, 2))
        )
        return joint_shares(change, limits_in_motion(PictureSettings()), 0.0).worst[ring - 1]

    assert share(10.0) <= 1.0
    assert share(49.6) > 1.0


def test_rings_without_neighbours_are_judged_by_their_sizes():
    some = np.zeros(3 * RINGS, np.bool_)
    some[rows_of(5) + rows_of(RINGS)] = True
    made = [pictures.moved(m, m.nodes, some) for m in frames(1)]
    assert judged(made).first is None
    wild = [shifted(m, [32], (0.0, 0.025 * max(0, k - BEGIN), 0)) for k, m in enumerate(made)]
    assert noticed_mm(judged(wild)) < 2.5
