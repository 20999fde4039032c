"""Cameras of a real bench: bias, frame, lost markers and frames, outliers, jitter, a rate of their own."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from support import mechanics
from tcrctl.plant.cameras import ImperfectCameras, draw_cameras, ring_frames
from tcrctl.plant.reality_settings import CameraSettings

RINGS, PERIOD = 4, 0.05
MARKERS = 3 * RINGS
ALL = np.ones(MARKERS, np.bool_)
VELOCITY = np.array([0.1, -0.05, 0.02])


def rings(turn=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0)):
    """Ring nodes (n_markers, 3) [m], turned and moved as a whole."""
    angles = 2.0 * np.pi / 3.0 * np.arange(3)
    ring = 0.035 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    nodes = np.vstack([ring - [0.0, 0.0, 0.05 * i] for i in range(RINGS)])
    return nodes @ mechanics.turned(np.array(turn)).T + shift


def visible(carries, t):
    return carries.copy()


def build(latency=0.0, noise=0.0, seed=1, **settings):
    cameras = ImperfectCameras(CameraSettings(**settings), MARKERS, latency, noise, seed)
    cameras.watch(0.0, rings())
    return cameras


def read(cameras, now=0.0):
    return cameras.read(now, ALL, visible)


def moving(cameras, steps, period=PERIOD, inner=50):
    """Frames read once a period while all nodes move with VELOCITY."""
    frames = [read(cameras)]
    for k in range(steps):
        for i in range(1, inner + 1):
            t = (k + i / inner) * period
            cameras.watch(t, rings(shift=VELOCITY * t))
        frames.append(read(cameras, (k + 1) * period))
    return frames


def test_perfect_cameras_report_what_is_there():
    for frame in moving(build(), 5):
        np.testing.assert_allclose(frame.nodes, rings(shift=VELOCITY * frame.t), rtol=0, atol=1e-15)
        assert frame.valid.all()


def test_a_marker_stays_beside_its_node_when_the_ring_turns():
    cameras = build(marker_bias_mm=2.0)
    bias = read(cameras).nodes - rings()
    np.testing.assert_allclose(np.linalg.norm(bias, axis=1), 2e-3, rtol=1e-9)
    assert np.linalg.norm(bias.mean(axis=0)) < 1.5e-3
    turn = np.array([0.3, -0.5, 0.8])
    cameras.watch(1.0, rings(turn, (0.1, 0.0, 0.0)))
    after = cameras.read(1.0, ALL, visible).nodes - rings(turn, (0.1, 0.0, 0.0))
    np.testing.assert_allclose(after, bias @ mechanics.turned(turn).T, rtol=0, atol=1e-12)


def test_the_axes_of_a_ring_are_a_rotation():
    axes = ring_frames(rings((0.2, 0.1, -0.4)))
    np.testing.assert_allclose(axes @ np.swapaxes(axes, 1, 2), np.tile(np.eye(3), (RINGS, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1.0)


def test_a_frame_that_is_off_turns_and_moves_everything_alike():
    off = {"rotation_deg": 0.5, "translation_mm": 1.0}
    cameras = build(frame_error=off)
    seen, true = read(cameras).nodes, rings()
    draw = draw_cameras(CameraSettings(frame_error=off), MARKERS, 1)
    assert np.linalg.norm(draw.rotation) == pytest.approx(np.radians(0.5))
    assert np.linalg.norm(draw.translation) == pytest.approx(1e-3)
    np.testing.assert_allclose(
        seen, true @ mechanics.turned(draw.rotation).T + draw.translation, rtol=0, atol=1e-12
    )


def test_lost_markers_are_that_share_and_independent():
    valid = np.array([read(build(lost_markers=0.1, seed=s)).valid for s in range(400)])
    assert 1.0 - valid.mean() == pytest.approx(0.1, abs=5.0 * np.sqrt(0.09 / valid.size))
    assert np.abs(np.corrcoef(valid.T) - np.eye(MARKERS)).max() < 0.25


@pytest.mark.slow
def test_a_lost_frame_is_the_last_one_again_with_its_time():
    frames = moving(build(lost_frames=0.3), 300)
    lost = 0
    for before, after in itertools.pairwise(frames):
        if after.t == before.t:
            lost += 1
            assert after.nodes is before.nodes
        np.testing.assert_allclose(after.nodes, rings(shift=VELOCITY * after.t), rtol=0, atol=1e-12)
    assert lost / 300 == pytest.approx(0.3, abs=0.12)


def test_before_the_first_frame_nothing_is_seen():
    frame = read(build(lost_frames=1.0))
    assert not frame.valid.any()
    assert not frame.nodes.any()


def test_outliers_are_that_share_and_that_far_away():
    away = np.array(
        [
            np.linalg.norm(
                read(build(outliers={"share": 0.05, "size_mm": 30.0}, seed=s)).nodes - rings(), axis=1
            )
            for s in range(400)
        ]
    )
    wild = away > 1e-9
    assert wild.mean() == pytest.approx(0.05, abs=5.0 * np.sqrt(0.05 / away.size))
    np.testing.assert_allclose(away[wild], 0.03, rtol=1e-9)


@pytest.mark.slow
def test_jitter_makes_frames_older_and_the_time_says_so():
    frames = moving(build(latency=0.01, age_jitter_ms=3.0), 400)[1:]
    ages = np.array([PERIOD * (k + 1) - frame.t for k, frame in enumerate(frames)]) - 0.01
    assert ages.min() >= -1e-12
    assert ages.mean() == pytest.approx(3e-3 * np.sqrt(2.0 / np.pi), rel=0.15)
    for frame in frames:
        np.testing.assert_allclose(frame.nodes, rings(shift=VELOCITY * frame.t), rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [13.0, 60.0])
def test_cameras_with_a_rate_of_their_own_deliver_their_newest_frame(rate):
    frames = moving(build(latency=0.012, rate_hz=rate), 100)
    for k, frame in enumerate(frames):
        number = frame.t * rate
        assert number == pytest.approx(round(number), abs=1e-9)
        due = np.floor((PERIOD * k - 0.012) * rate + 1e-9) / rate
        assert frame.t == pytest.approx(max(0.0, due), abs=1e-12)
        np.testing.assert_allclose(frame.nodes, rings(shift=VELOCITY * frame.t), rtol=0, atol=1e-9)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_frames_and_another_one_does_not():
    settings = {"marker_bias_mm": 1.0, "lost_markers": 0.1, "lost_frames": 0.1, "age_jitter_ms": 2.0}

    def told(seed):
        frames = moving(build(noise=5e-5, seed=seed, **settings), 30)
        return [frame.nodes.tobytes() + frame.valid.tobytes() for frame in frames]

    assert told(3) == told(3)
    assert told(3) != told(4)
    own = CameraSettings(marker_bias_mm=1.0, seed=9)
    assert np.array_equal(draw_cameras(own, MARKERS, 3).bias, draw_cameras(own, MARKERS, 4).bias)
