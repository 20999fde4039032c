"""What is drawn of a task is where its markers say, and gets into the scene of viewers and the page of a run."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.history import read_histories
from tcrctl.experiment import provenance
from tcrctl.experiment.spec import load_spec
from tcrctl.log.drawing import Drawing, cone
from tcrctl.log.scene import Scene
from tcrctl.report.numbers import payload
from tcrctl.task.task import task_drawing

BOX, PIPES = (task_drawing(load_spec(name).spec.task) for name in ("box_scan", "laser_pipe"))


def outlines(drawing, kind):
    return [outline.points for outline in drawing.outlines if outline.kind == kind]


def test_a_run_without_a_task_has_nothing_to_draw():
    assert task_drawing(None) == Drawing()
    assert task_drawing(None).corners.shape == (0, 3)


def test_a_hole_lies_round_its_markers_as_wide_as_it_is():
    markers = 1e-3 * np.array(load_spec("box_scan").spec.task.box.markers_mm)
    middle = markers.mean(axis=0)
    (left,) = [hole for hole in outlines(BOX, "hole") if np.linalg.norm(hole.mean(axis=0) - middle) < 1e-9]
    assert_allclose(np.linalg.norm(left - middle, axis=1), 0.036, atol=1e-12)
    into = np.cross(markers[1] - markers[0], markers[3] - markers[0])
    assert_allclose((left - middle) @ into, 0.0, atol=1e-12)
    assert len(outlines(BOX, "hole")) == 3


def test_every_object_is_inside_the_walls():
    walls = np.concatenate(outlines(BOX, "wall"))
    assert [ball.name for ball in BOX.balls] == ["key", "mouse", "handcraft"]
    for ball in BOX.balls:
        assert np.all(ball.centre - ball.radius > walls.min(axis=0))
        assert np.all(ball.centre + ball.radius < walls.max(axis=0))


def test_the_rim_of_a_view_is_as_far_and_as_wide_as_the_camera_sees():
    rim = cone(BOX.sight) - (0.0, 0.0, -0.0558)
    assert_allclose(np.linalg.norm(rim, axis=1), 0.08, atol=1e-12)
    assert_allclose(np.degrees(np.arccos(-rim[:, 2] / 0.08)), 30.0, atol=1e-9)


@pytest.mark.parametrize("i", [0, 1])
def test_a_pipe_leads_from_its_entry_markers_to_its_exit_markers(i):
    settings, passage = load_spec("laser_pipe").spec.task.pipes[i], PIPES.passages[i]
    entry, exit_ = (1e-3 * np.mean(m, axis=0) for m in (settings.entry_markers_mm, settings.exit_markers_mm))
    assert passage.name == settings.name
    assert_allclose(passage.entry, entry, atol=1e-9)
    assert_allclose(passage.entry + passage.length * passage.axis, exit_, atol=1e-5)
    assert passage.radius == pytest.approx(0.008)
    assert np.linalg.norm(outlines(PIPES, "screen")[i].mean(axis=0) - exit_) == pytest.approx(passage.screen)


@pytest.mark.parametrize(("drawing", "names"), [(BOX, ("camera", "object mouse")), (PIPES, ("beam",))])
def test_the_scene_of_viewers_holds_the_task_and_what_the_end_sends_out(drawing, names):
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
    from google.protobuf.timestamp_pb2 import Timestamp

    geometry = dataclasses.replace(records.geometry(), drawing=drawing)
    nodes = records.shape(0.0, 3, np.random.default_rng(0)).reshape(-1, 3)
    update = SceneUpdate.FromString(Scene(geometry).encode_static(nodes, True, Timestamp()))
    entities = {entity.id: entity for entity in update.entities}
    assert len(entities["task"].lines) == len(drawing.outlines)
    assert entities["task"].frame_id == "world"
    assert set(names) <= set(entities)
    assert (entities[names[0]].frame_id, entities[names[0]].frame_locked) == ("m3", True)


def test_the_page_knows_when_an_object_was_seen_and_opens_at_the_last_event_of_the_task(tmp_path):
    spec = load_spec("box_scan")
    with open_log(tmp_path / "log.mcap", attachments=provenance.attachments(spec, spec.spec)) as log:
        for k in range(20):
            log.step(records.record(k))
        log.event(0.25, "task", "info", "key seen")
        log.event(0.6, "other", "info", "no matter of the task")
        log.finish(STOP)
    histories = read_histories([tmp_path / "log.mcap"])
    result = {"status": "success", "task": {"objects": [{"name": "key", "first_seen_s": 0.25}]}}
    made = payload(histories, [result])
    (run,) = made["runs"]
    assert {ball["name"]: ball["seen"] for ball in run["task"]["balls"]} == {
        "key": 0.25,
        "mouse": None,
        "handcraft": None,
    }
    assert made["open"] == 0.25
    assert payload(histories, [{**result, "status": "aborted"}])["open"] == pytest.approx(0.95)
