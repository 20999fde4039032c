"""Tasks judged on steps made by hand: where things are, what is seen, what is touched."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import RootModel

from support.records import record
from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.robot import pose
from tcrctl.signals import Reference, Truth
from tcrctl.task.body import SIDES, segment_name, segments
from tcrctl.task.box import box_from_markers, hole_target
from tcrctl.task.perforated_plate import blocks, nearest
from tcrctl.task.pipe import pipe_from_markers
from tcrctl.task.settings import WALLS, TaskSettings
from tcrctl.task.task import build_task, task_targets

PIPE = {
    "name": "p",
    "entry_markers_mm": [[320, 0, 20], [320, 17.3205, -10], [320, -17.3205, -10]],
    "exit_markers_mm": [[520, 0, 20], [520, 17.3205, -10], [520, -17.3205, -10]],
    "bore_mm": 16,
}
BOX = {
    "markers_mm": [[200, 44, 44], [200, -44, 44], [200, -44, -44], [200, 44, -44]],
    "size_mm": [120, 110, 100],
    "holes": [
        {"name": "in", "wall": "left", "diameter_mm": 72, "standoff_mm": 30},
        {"name": "lid", "wall": "top", "diameter_mm": 40, "center_mm": [10, -5], "standoff_mm": 20},
    ],
}
INSPECTION = {
    "kind": "box_inspection",
    "box": BOX,
    "camera": {"field_of_view_deg": 60, "range_mm": 300},
    "objects": [{"name": "key", "position_mm": [60, 0, 0], "diameter_mm": 10}],
}
LASER = {"kind": "laser_pipe", "pipes": [PIPE]}
coordinate = st.floats(-0.2, 0.2)
vectors = st.tuples(coordinate, coordinate, coordinate).map(np.array)


class Section(RootModel[TaskSettings]):
    pass


def parsed(section, **changes):
    return Section.model_validate_json(json.dumps({**section, **changes})).root


def placed(position, axis, k=0, **changes):
    """Step k: the end stands at ``position`` [m] and looks along ``axis``, and so it should."""
    position, normal = np.array(position, float), -np.array(axis, float)
    step = record(k)
    truth = Truth(position, normal, step.truth.tension, step.truth.q)
    reference = Reference(step.t, position, normal, position[None], normal[None])
    return replace(step, truth=truth, reference=reference, **changes)


def moved(settings, turn, shift):
    """Marker coordinates [mm] of the settings, turned and shifted [m]."""
    rotation = matrix_from_quaternion(quaternion_exp(10.0 * turn))
    return [(rotation @ np.array(marker) + 1e3 * shift).tolist() for marker in settings]


@pytest.mark.slow
@given(vectors, vectors)
def test_the_pose_of_a_pipe_moves_with_its_markers(turn, shift):
    rotation = matrix_from_quaternion(quaternion_exp(10.0 * turn))
    markers = {key: moved(PIPE[key], turn, shift) for key in ("entry_markers_mm", "exit_markers_mm")}
    pipe = pipe_from_markers(parsed(LASER, pipes=[{**PIPE, **markers}]).pipes[0])
    assert np.allclose(pipe.bore.axis, rotation @ [1.0, 0.0, 0.0], atol=1e-9)
    assert np.allclose(pipe.bore.entry, rotation @ [0.32, 0.0, 0.0] + shift, atol=1e-8)
    assert math.isclose(pipe.bore.length, 0.2, rel_tol=1e-9)
    assert np.allclose(pipe.target.position, rotation @ [0.27, 0.0, 0.0] + shift, atol=1e-8)
    assert np.allclose(pipe.target.normal, -pipe.bore.axis)


@pytest.mark.slow
@given(vectors, vectors)
def test_the_pose_of_a_box_moves_with_its_markers(turn, shift):
    rotation = matrix_from_quaternion(quaternion_exp(10.0 * turn))
    settings = parsed(INSPECTION, box={**BOX, "markers_mm": moved(BOX["markers_mm"], turn, shift)}).box
    box = box_from_markers(settings)
    assert np.allclose(box.frame.T, rotation, atol=1e-9)
    assert np.allclose(box.place(np.array([60.0, 10.0, -5.0])), rotation @ [0.26, 0.01, -0.005] + shift)
    target = hole_target(settings, box, settings.holes[1])
    assert np.allclose(target.position, rotation @ [0.27, -0.005, 0.07] + shift)
    assert np.allclose(target.normal, rotation @ [0.0, 0.0, 1.0])  # the end looks down into the lid's hole


def test_every_wall_looks_inwards_and_together_they_are_closed():
    settings = parsed(INSPECTION).box
    walls = box_from_markers(settings).walls
    centre = np.array([0.26, 0.0, 0.0])
    for i, wall in enumerate(WALLS):
        distance = (centre - walls.middle[i]) @ walls.frame[i, 2]
        assert distance == pytest.approx(1e-3 * settings.size_mm[WALLS[wall][0]] / 2.0)
        corners = [
            walls.middle[i]
            + a * walls.half[i, 0] * walls.frame[i, 0]
            + b * walls.half[i, 1] * walls.frame[i, 1]
            for a in (-1, 1)
            for b in (-1, 1)
        ]
        assert np.allclose(np.abs(np.array(corners) - centre), [0.06, 0.055, 0.05])


def test_noise_of_the_markers_moves_the_target_but_not_the_pipe():
    exact, noisy = parsed(LASER), parsed(LASER, marker_noise_um=50)
    targets = [task_targets(noisy, seed)["p"].position for seed in range(200)]
    spread = np.std(np.array(targets) - task_targets(exact, 0)["p"].position, axis=0)
    assert np.allclose(spread[0], 50e-6 / math.sqrt(3.0), rtol=0.2)  # the mean of three markers
    assert np.array_equal(task_targets(noisy, 5)["p"].position, task_targets(noisy, 5)["p"].position)
    assert not np.array_equal(targets[0], targets[1])
    task = build_task(noisy, 3, 0.005)
    task.observe(replace(placed(targets[3], [1, 0, 0]), reference=_aim(noisy, 3)))
    (target,) = task.result()["targets"]
    assert target["position_error_mm"] == pytest.approx(1e3 * np.linalg.norm(targets[3] - [0.27, 0, 0]))


def _aim(settings, seed):
    aim = task_targets(settings, seed)["p"]
    return Reference(0.0, aim.position, aim.normal, aim.position[None], aim.normal[None])


def test_the_laser_is_judged_only_while_the_end_is_wanted_at_the_target():
    task = build_task(parsed(LASER), 0, 0.005)
    assert list(task.observe(placed([0.2, 0.0, 0.0], [1, 0, 0]))) == []
    (target,) = task.result()["targets"]
    assert (target["beam_passes"], target["position_error_mm"], target["dwell_s"]) == (False, None, 0.0)
    (event,) = task.observe(placed([0.27, 0.0, 0.0], [1, 0, 0], k=1))
    assert (event.level, event.t) == ("info", 0.05)
    assert "goes through" in event.message
    (target,) = task.result()["targets"]
    assert target["beam_passes"]
    assert target["bore_clearance_mm"] == pytest.approx(7.5)
    assert target["spot_offset_mm"] == pytest.approx(0.0, abs=1e-9)
    assert target["dwell_s"] == pytest.approx(0.05)


def test_the_worst_step_of_a_dwell_decides():
    task, good = build_task(parsed(LASER), 0, 0.005), placed([0.27, 0.0, 0.0], [1, 0, 0])
    slope = 0.04
    tilted = np.array([-math.cos(slope), 0.0, -math.sin(slope)])
    off = replace(good, truth=replace(good.truth, normal=tilted, position=np.array([0.27, 0.0, 0.001])))
    levels = [event.level for step in (good, good, off, off, good) for event in task.observe(step)]
    assert levels == ["info", "warning"]
    (target,) = task.result()["targets"]
    assert not target["beam_passes"]
    assert target["position_error_mm"] == pytest.approx(1.0)
    assert target["theta_y_error_rad"] == pytest.approx(slope)
    assert target["bore_clearance_mm"] == pytest.approx(7.5 - 1.0 - 250.0 * math.tan(slope))
    assert target["spot_offset_mm"] is None


def test_a_rig_is_judged_by_its_estimate():
    task, step = build_task(parsed(LASER), 0, 0.005), placed([0.27, 0.0, 0.0], [1, 0, 0])
    seen = replace(step.estimate, position=np.array([0.27, 0.003, 0.0]), normal=np.array([-1.0, 0.0, 0.0]))
    task.observe(replace(step, truth=None, estimate=seen))
    (target,) = task.result()["targets"]
    assert target["position_error_mm"] == pytest.approx(3.0)
    assert target["beam_passes"]


def test_an_object_is_seen_through_the_hole_and_not_through_the_wall():
    task = build_task(parsed(INSPECTION), 0, 0.005)
    key = np.array([0.26, 0.0, 0.0])
    beside = np.array([0.1, 0.12, 0.0])  # the line of sight meets the wall 45 mm from the hole's middle
    towards = (key - beside) / np.linalg.norm(key - beside)
    assert list(task.observe(placed(beside, towards, k=0))) == []
    before = np.array([0.1, 0.03, 0.0])
    towards = (key - before) / np.linalg.norm(key - before)
    assert list(task.observe(placed(before, -towards, k=1))) == []  # looks away
    (event,) = task.observe(placed(before, towards, k=2))
    assert "key" in event.message
    assert list(task.observe(placed(before, towards, k=3))) == []
    result = task.result()
    assert result["objects"] == [{"name": "key", "detected": True, "first_seen_s": pytest.approx(0.1)}]
    assert (result["detected"], result["detection_s"], result["collision"]) == (1, pytest.approx(0.1), False)
    assert result["smallest_clearance_mm"] > 0.0


def test_nothing_is_compiled_when_an_object_comes_into_view():
    task = build_task(parsed(INSPECTION), 0, 0.005)
    task.observe(placed([0.1, 0.0, 0.0], [-1, 0, 0]))
    before = {kernel: list(kernel.signatures) for kernel in (blocks, nearest)}
    assert task.observe(placed([0.1, 0.0, 0.0], [1, 0, 0], k=1))
    assert all(kernel.signatures == known != [] for kernel, known in before.items())


def test_an_object_behind_another_is_hidden():
    items = [
        {"name": "near", "position_mm": [40, 0, 0], "diameter_mm": 8},
        {"name": "far", "position_mm": [80, 0, 0], "diameter_mm": 8},
        {"name": "aside", "position_mm": [80, 20, 0], "diameter_mm": 8},
    ]
    task = build_task(parsed(INSPECTION, objects=items), 0, 0.005)
    task.observe(placed([0.15, 0.0, 0.0], [1, 0, 0]))
    assert [item["detected"] for item in task.result()["objects"]] == [True, False, True]
    assert task.result()["detection_s"] is None


def bent(task, k, shift):
    """Observe a robot shifted by ``shift`` [m] that looks at the key from where it sees it."""
    step = placed([0.15, 0.0, 0.0], [1, 0, 0], k=k)
    q = (step.truth.q.reshape(-1, 3) + shift).ravel()
    return list(task.observe(replace(step, truth=replace(step.truth, q=q))))


def test_what_is_first_seen_after_a_collision_does_not_count():
    seen, blind = (build_task(parsed(INSPECTION), 0, 0.005) for _ in range(2))
    touching = np.array([0.18, 0.0, 0.1])  # the rings around x = 0.18 + 0.035 reach into the left wall
    assert [event.level for event in bent(seen, 0, np.zeros(3))] == ["info"]
    assert [event.level for event in bent(seen, 1, touching)] == ["error"]
    assert bent(seen, 2, touching) == []
    assert [event.level for event in bent(blind, 0, touching)] == ["error"]
    assert seen.result()["detected"] == 1
    assert blind.result()["detected"] == 0
    assert blind.result()["collision_s"] == 0.0
    assert seen.result()["collision_s"] == pytest.approx(0.05)
    assert "wall" in seen.result()["collision_between"]
    assert seen.result()["smallest_clearance_mm"] <= 0.0


@pytest.mark.slow
@given(vectors)
def test_the_clearance_is_that_of_the_nearest_ring_or_rod(shift):
    shift = shift + np.array([0.3, 0.0, 0.1])
    settings = parsed(INSPECTION, box={**BOX, "wall_mm": 0})
    task, walls = build_task(settings, 0, 0.0), box_from_markers(settings.box).walls
    bent(task, 0, shift)
    start, end = segments(np.asarray(record(0).truth.q))
    way = start[:, None] + np.linspace(0.0, 1.0, 21)[None, :, None] * (end - start)[:, None] + shift
    nearest = min(_sampled_distance(walls, i, way.reshape(-1, 3)) for i in range(6))
    found = 1e-3 * task.result()["smallest_clearance_mm"]
    assert found <= nearest + 1e-5
    assert found >= nearest - 2e-3  # half the way between two samples of a rod


def _sampled_distance(walls, i, points):
    """Least distance of points to a wall, by numpy."""
    u, v, w = ((points - walls.middle[i]) @ walls.frame[i].T).T
    beyond = np.maximum(np.abs(np.stack((u, v))) - walls.half[i][:, None], 0.0)
    distance = np.sqrt(beyond[0] ** 2 + beyond[1] ** 2 + w**2)
    for hole in walls.holes[walls.first_hole[i] : walls.first_hole[i + 1]]:
        radius = np.hypot(u - hole[0], v - hole[1])
        distance = np.where(radius < hole[2], np.hypot(hole[2] - radius, w), distance)
    return distance.min()


def test_the_body_is_made_of_rods_and_closed_rings(tcr700):
    q = tcr700.rest.q
    start, end = segments(q)
    modules = tcr700.n_modules + 1
    rows = start.reshape(modules, 3 + SIDES, 3), end.reshape(modules, 3 + SIDES, 3)
    nodes = q.reshape(modules, 4, 3)
    assert np.allclose(rows[0][:, :3], nodes[:, :3])
    assert np.allclose(rows[1][:, :3], nodes[:, 3:])
    assert np.allclose(np.roll(rows[0][:, 3:], -1, axis=1), rows[1][:, 3:])
    tip = rows[0][-1, 3:]
    assert np.allclose(np.linalg.norm(tip - pose.position(q, tcr700.tip), axis=1), 0.035, rtol=0.005)
    assert np.allclose((tip - tip[0]) @ pose.normal(q, tcr700.tip), 0.0, atol=1e-5)
    assert segment_name(0) == "rod base.n1"
    assert segment_name(len(start) - 1) == "ring m13"
    assert segment_name(13 * (3 + SIDES) + 2) == "rod m13.n3"
