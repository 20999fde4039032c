"""Laws of lost markers: complete frames pass, rings are carried rigidly, what is lost long is forgotten."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.estimator.lost_markers import LONGEST, LostMarkers
from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.signals import Measurement

PERIOD = 0.05
ANGLES = np.arange(3) * 2.0 * np.pi / 3.0
RING = 0.035 * np.stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(3)], axis=1)
#: Two rings, one below the other, none of them quite regular.
NODES = np.concatenate([RING - [0, 0, 0.05], RING - [0, 0, 0.1]]) + 1e-3 * np.sin(np.arange(18.0)).reshape(
    6, 3
)
UP, ASIDE = np.array([0.0, 0.0, 0.003]), np.array([0.01, 0.0, 0.0])
ALL = np.ones(6, dtype=np.bool_)
angles = st.tuples(*[st.floats(-0.3, 0.3)] * 3).map(np.array)
shifts = st.tuples(*[st.floats(-0.02, 0.02)] * 3).map(np.array)


def frame(valid: np.ndarray, nodes: np.ndarray = NODES) -> Measurement:
    return Measurement(0.0, np.where(valid[:, None], nodes, np.nan).astype(np.float32), valid, np.zeros(1))


def without(*lost: int) -> np.ndarray:
    valid = ALL.copy()
    valid[list(lost)] = False
    return valid


def moved(nodes: np.ndarray, angle: np.ndarray, shift: np.ndarray) -> np.ndarray:
    return nodes @ matrix_from_quaternion(quaternion_exp(angle)).T + shift


@pytest.fixture
def lost() -> LostMarkers:
    markers = LostMarkers(6, PERIOD)
    markers.filled(frame(ALL))
    return markers


def test_a_complete_frame_passes_as_it_is(lost):
    given_frame = frame(ALL, NODES + 1.0)
    assert lost.filled(given_frame) is given_frame


@given(angle=angles, shift=shifts, gone=st.sets(st.integers(3, 5), min_size=1))
def test_a_ring_that_moves_with_the_one_below_is_found_again(angle, shift, gone):
    markers = LostMarkers(6, PERIOD)
    markers.filled(frame(ALL))
    after = moved(NODES, angle, shift)
    filled = markers.filled(frame(without(*gone), after))
    assert filled.valid.all()
    assert filled.nodes == pytest.approx(after, abs=2e-7)


@given(angle=angles, shift=shifts, gone=st.integers(0, 5))
def test_a_ring_keeps_its_shape_whatever_its_joint_does(angle, shift, gone):
    markers = LostMarkers(6, PERIOD)
    markers.filled(frame(ALL))
    first = 3 * (gone // 3)
    after = NODES.copy()
    after[first : first + 3] = moved(NODES[first : first + 3], angle, shift)
    found = markers.filled(frame(without(gone), after)).nodes[first : first + 3]

    def sides(ring):
        return np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)

    assert sides(found) == pytest.approx(sides(NODES[first : first + 3]), abs=3e-7)


def test_one_marker_shifts_its_ring_and_nothing_turns_it(lost):
    filled = lost.filled(frame(without(4, 5), NODES + UP * (np.arange(6) >= 3)[:, None]))
    assert filled.nodes[3:] == pytest.approx(NODES[3:] + UP, abs=1e-7)


def test_a_marker_is_carried_on_from_frame_to_frame(lost):
    for step in range(1, 4):
        filled = lost.filled(frame(without(3, 4, 5) if step < 2 else without(5), NODES + step * 1e-3))
        assert filled.nodes[5] == pytest.approx(NODES[5] + step * 1e-3, abs=1e-6)


def test_after_a_while_it_counts_as_not_seen(lost):
    valid = [lost.filled(frame(without(2))).valid[2] for _ in range(int(LONGEST / PERIOD) + 1)]
    assert valid[0]
    assert not valid[-1]


def test_a_ring_that_is_lost_whole_is_filled_in_whole_and_forgotten_whole(lost):
    """Two of three would turn it: whatever its markers did before, they come and go together."""
    for _ in range(int(0.6 * LONGEST / PERIOD)):
        lost.filled(frame(without(3)))
    found = [lost.filled(frame(without(3, 4, 5))).valid[3:] for _ in range(int(LONGEST / PERIOD) + 1)]
    assert found[0].all()
    assert all(ring.all() or not ring.any() for ring in found)
    assert not found[-1].any()


def test_a_marker_that_was_never_seen_is_not_invented():
    fresh = LostMarkers(6, PERIOD)
    assert not fresh.filled(frame(without(2))).valid[2]
    assert not fresh.filled(frame(without(2))).valid[2]
    assert fresh.filled(frame(ALL)).valid.all()


def test_a_ring_that_was_never_whole_does_not_carry_the_next():
    fresh = LostMarkers(6, PERIOD)
    fresh.filled(frame(without(2)))
    after = NODES + ASIDE
    filled = fresh.filled(frame(without(2, 5), after))
    assert filled.nodes[5] == pytest.approx(after[5], abs=1e-7)  # by the two that are seen
