"""Distorted pictures: frames that are turned and mirrored, labels that move, and markers that drift."""

from __future__ import annotations

import numpy as np
import pytest

from tcr_hardware.emulators.motive_distortion import Distortion
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_markers import TrackedMarkers

NAMES = [f"{body}.n{node}" for body in ("base", "m1", "m2") for node in (1, 2, 3)]
AT = np.random.default_rng(3).normal(size=(9, 3))
TRACKED = TrackedMarkers(NAMES, AT)


def seen(now=0.0, made=None, **faults):
    return (made or Distortion()).seen(TRACKED, AT, MotiveFaults(**faults), now)


def distances(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)


def test_without_faults_markers_are_where_they_are():
    np.testing.assert_array_equal(seen(), AT)


@pytest.mark.parametrize("pivot", ["", "base", "m2"])
def test_a_turned_frame_is_rigid_and_keeps_its_pivot(pivot):
    turned = seen(turned_deg=(10.0, -20.0, 30.0), pivot=pivot)
    np.testing.assert_allclose(distances(turned), distances(AT), atol=1e-12)
    rows = TRACKED.rows_of(pivot) if pivot else []
    fixed = (turned[rows].mean(axis=0), AT[rows].mean(axis=0)) if pivot else (seen_origin(), np.zeros(3))
    np.testing.assert_allclose(*fixed, atol=1e-12)
    assert np.abs(turned - AT).max() > 0.1


def seen_origin():
    """Where a marker in the origin is seen."""
    at = AT.copy()
    at[0] = 0.0
    return Distortion().seen(TRACKED, at, MotiveFaults(turned_deg=(10.0, -20.0, 30.0)), 0.0)[0]


def test_a_mirrored_frame_keeps_distances_and_turns_every_ring_over():
    mirrored = seen(mirrored=(0.0, 2.0, 0.0), pivot="base")
    np.testing.assert_allclose(distances(mirrored), distances(AT), atol=1e-12)
    volume = np.linalg.det(AT[3:6] - AT[0]), np.linalg.det(mirrored[3:6] - mirrored[0])
    assert volume[1] == pytest.approx(-volume[0])


def test_labels_that_move_on_three_times_are_back():
    made, at = Distortion(), AT
    for _ in range(3):
        at = made.seen(TRACKED, at, MotiveFaults(moved_labels=frozenset(["m1"])), 0.0)
        np.testing.assert_array_equal(np.sort(at[3:6, 0]), np.sort(AT[3:6, 0]))
    np.testing.assert_array_equal(at, AT)
    assert not np.array_equal(seen(moved_labels=frozenset(["m1"]))[3:6], AT[3:6])


def test_exchanged_bodies_have_each_others_markers():
    at = seen(exchanged=(("m1", "m2"),))
    np.testing.assert_array_equal(at[3:6], AT[6:])
    np.testing.assert_array_equal(at[6:], AT[3:6])
    np.testing.assert_array_equal(at[:3], AT[:3])


def test_a_drift_grows_with_time_from_when_it_begins_and_begins_anew():
    made, faults = Distortion(), {"drifting": frozenset(["m2", "m1.n2"]), "drift_mm_s": (0.0, 0.5, 0.0)}
    for now, millimetres in ((10.0, 0.0), (12.0, 1.0), (16.0, 3.0)):
        moved = 1e3 * (seen(now, made, **faults) - AT)
        np.testing.assert_allclose(moved[[4, 6, 7, 8], 1], millimetres, atol=1e-9)
        np.testing.assert_array_equal(moved[[0, 1, 2, 3, 5]], 0.0)
    np.testing.assert_array_equal(seen(17.0, made), AT)
    np.testing.assert_array_equal(seen(20.0, made, **faults), AT)


def test_a_turning_frame_turns_at_its_rate():
    made = Distortion()
    for now, angle in ((5.0, 0.0), (7.0, 20.0)):
        np.testing.assert_allclose(
            seen(now, made, turning_deg_s=(0.0, 0.0, 10.0), pivot="base"),
            seen(turned_deg=(0.0, 0.0, angle), pivot="base"),
            atol=1e-12,
        )
