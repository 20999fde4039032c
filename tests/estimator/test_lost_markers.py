"""Laws of lost markers: a complete frame passes, a lost one comes back beside its node and is forgotten in time."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.estimator.lost_markers import FILTER, LONGEST, LostMarkers
from tcrctl.signals import Measurement

PERIOD = 0.05
NODES = np.arange(18.0).reshape(6, 3) / 10.0
BESIDE = np.full((6, 3), 1e-3)


def frame(valid: np.ndarray) -> Measurement:
    markers = np.where(valid[:, None], NODES + BESIDE, 0.0)
    return Measurement(0.0, markers.astype(np.float32), valid, np.zeros(1))


ALL = np.ones(6, dtype=np.bool_)
ONE_LOST = np.array([True, True, False, True, True, True])


@pytest.fixture
def lost() -> LostMarkers:
    markers = LostMarkers(6, PERIOD)
    for _ in range(int(5 * FILTER / PERIOD)):
        markers.remember(ALL, markers.filled(frame(ALL), NODES).nodes, NODES)
    return markers


def test_a_complete_frame_passes_as_it_is(lost):
    given = frame(ALL)
    assert lost.filled(given, NODES + 1.0) is given


def test_a_lost_marker_is_put_beside_its_node(lost):
    filled = lost.filled(frame(ONE_LOST), NODES)
    assert filled.valid.all()
    assert filled.nodes == pytest.approx(NODES + BESIDE, abs=1e-6)


def test_it_moves_with_its_node(lost):
    filled = lost.filled(frame(ONE_LOST), NODES + 0.01)
    assert filled.nodes[2] == pytest.approx(NODES[2] + BESIDE[2] + 0.01, abs=1e-6)


def test_after_a_while_it_counts_as_not_seen(lost):
    steps = int(LONGEST / PERIOD) + 1
    valid = [lost.filled(frame(ONE_LOST), NODES).valid[2] for _ in range(steps)]
    assert valid[0]
    assert not valid[-1]


def test_a_marker_that_was_never_seen_is_not_invented():
    fresh = LostMarkers(6, PERIOD)
    assert not fresh.filled(frame(ONE_LOST), NODES).valid[2]


def test_a_ring_that_is_lost_whole_is_filled_in_for_a_tenth_of_a_second(lost):
    valid = np.array([True, True, True, False, False, False])
    found = [lost.filled(frame(valid), NODES).valid[3:] for _ in range(round(0.1 / PERIOD) + 2)]
    assert found[0].all()
    assert not found[-1].any()
