"""Laws of the topics derived for viewers."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from foxglove import messages
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from support import records
from support.log_files import STOP, open_log
from tcrctl.log.reader import read_log
from tcrctl.log.ring_frames import quaternion_of_normal, quaternions, ring_frames
from tcrctl.log.viewer_topics import SCENE_RATE_HZ, TOPICS, VIEWER_RATE_HZ, stride


@pytest.fixture
def finished(tmp_path):
    path = tmp_path / "log.mcap"
    with open_log(path) as log:
        for k in range(40):
            log.step(records.record(k))
        log.finish(STOP)
    return path


@pytest.mark.parametrize("period", [1e-3, 4e-3, 1 / 60, 0.05, 0.2])
def test_viewer_topics_stay_below_their_rates(period):
    for rate in (VIEWER_RATE_HZ, SCENE_RATE_HZ):
        steps_per_message = stride(period, rate)
        assert 1 / (steps_per_message * period) <= rate * (1 + 1e-6)
        assert steps_per_message == 1 or 1 / ((steps_per_message - 1) * period) > rate * (1 - 1e-6)


def test_frames_on_tf_carry_ring_coordinates_to_the_world(finished):
    steps = {step.k: step for step in read_log(finished).steps()}
    checked = 0
    for schema, message in _messages(finished, "/tf"):
        assert schema.name == "foxglove.FrameTransforms"
        shape = steps[message.sequence].truth.q.reshape(-1, 4, 3)
        transforms = _decoded(schema, message).transforms
        assert [frame.child_frame_id for frame in transforms] == ["base", "m1", "m2", "m3", "reference"]
        wanted = transforms.pop()
        np.testing.assert_allclose(
            _xyz(wanted.translation), steps[message.sequence].reference.position, atol=1e-5
        )
        for frame, module in zip(transforms, shape, strict=True):
            rotation = Rotation.from_quat([getattr(frame.rotation, axis) for axis in "xyzw"])
            origin = np.array([getattr(frame.translation, axis) for axis in "xyz"])
            radius = np.linalg.norm(module[0] - module[:3].mean(axis=0))
            np.testing.assert_allclose(rotation.apply([radius, 0, 0]) + origin, module[0], atol=2e-5)
            assert rotation.apply([0, 0, 1])[2] > 0.9
            checked += 1
    assert checked == 4 * 40


def test_the_scene_draws_every_rod_and_spring_and_colours_cables_by_tension(finished):
    steps = {step.k: step for step in read_log(finished).steps()}
    scenes = list(_messages(finished, "/scene"))
    assert [message.sequence for _, message in scenes] == list(range(0, 40, 4))
    for schema, message in scenes:
        assert schema.name == "foxglove.SceneUpdate"
        entities = {entity.id: entity for entity in _decoded(schema, message).entities}
        nodes = steps[message.sequence].truth.q.reshape(-1, 3)
        rods = entities["rods"].lines[0]
        np.testing.assert_allclose(_points(rods), nodes, atol=7e-5)
        ends = np.array(rods.indices).reshape(-1, 2)
        assert {tuple(pair) for pair in ends} == {(4 * i + j, 4 * i + 3) for i in range(4) for j in range(3)}
        springs = _points(entities["springs"].lines[0]).reshape(-1, 2, 3)
        np.testing.assert_allclose(springs, nodes[records.geometry().springs], atol=7e-5)
        red = [entities[f"cable c{j}"].lines[0].color.r for j in (1, 2, 3)]
        assert list(np.argsort(red)) == list(np.argsort(steps[message.sequence].truth.tension))


def test_what_stands_still_in_its_frame_is_drawn_once(finished):
    ((schema, message),) = _messages(finished, "/scene/static")
    assert message.sequence == 0
    entities = {entity.id: entity for entity in _decoded(schema, message).entities}
    frames = {f"ring {name}": name for name in ("base", "m1", "m2", "m3")} | {"wanted end": "reference"}
    assert {name: entities[name].frame_id for name in frames} == frames
    assert all(entities[name].frame_locked for name in frames)
    for name in list(frames)[:4]:
        np.testing.assert_allclose(np.linalg.norm(_points(entities[name].lines[0]), axis=1), 0.035, atol=2e-4)
    for name in ("ring m3", "wanted end"):
        turn = entities[name].arrows[0].pose.orientation
        along = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).apply([1.0, 0.0, 0.0])
        np.testing.assert_allclose(along, [0.0, 0.0, -1.0], atol=1e-12)
    path = records.geometry().reference_path
    np.testing.assert_allclose(_points(entities["wanted path"].lines[0]), path, atol=7e-5)


def test_a_free_orientation_has_no_wanted_axis(tmp_path):
    step = records.record(0)
    free = dataclasses.replace(step, reference=dataclasses.replace(step.reference, normal=None))
    with open_log(tmp_path / "log.mcap") as log:
        log.step(free)
        log.finish(STOP)
    ((schema, message),) = _messages(tmp_path / "log.mcap", "/scene/static")
    (wanted,) = (entity for entity in _decoded(schema, message).entities if entity.id == "wanted end")
    assert (len(wanted.spheres), len(wanted.arrows)) == (1, 0)


@pytest.mark.slow
@pytest.mark.parametrize("topic", [*TOPICS, "/log"])
def test_schemas_are_those_of_foxglove(finished, topic):
    """Their own kit is the judge: every field of ours has the same name, number, type and place there."""
    with open(finished, "rb") as stream:
        summary = make_reader(stream).get_summary()
    (channel,) = (channel for channel in summary.channels.values() if channel.topic == topic)
    ours = summary.schemas[channel.schema_id]
    theirs = getattr(messages, ours.name.removeprefix("foxglove.")).get_schema()
    assert (ours.name, ours.encoding, channel.message_encoding) == (theirs.name, theirs.encoding, "protobuf")
    assert _fields(ours.data) <= _fields(theirs.data)
    assert any(name.startswith(ours.name + ".") for name, *_ in _fields(ours.data))


def _fields(schema):
    """Every field of every message type of a schema, as name, number, type and label."""
    return {
        (
            f".{file.package}.{message.name}.{field.name}"[1:],
            field.number,
            field.type,
            field.label,
            field.type_name,
        )
        for file in descriptor_pb2.FileDescriptorSet.FromString(schema).file
        for message in file.message_type
        for field in message.field
    }


def test_an_unseen_end_marker_or_a_broken_shape_draws_nothing(tmp_path):
    path = tmp_path / "log.mcap"
    step = records.record(0)
    step.measurement.valid[-1] = False
    step.truth.q[5] = np.nan
    with open_log(path) as log:
        log.step(step)
        log.finish(STOP)
    for topic in ("/tip/measured", "/tf", "/backbone", "/scene", "/scene/static"):
        assert list(_messages(path, topic)) == []
    assert len(list(_messages(path, "/tip/reference"))) == 1


def test_quaternions_are_those_of_an_independent_library():
    turns = Rotation.random(500, rng=np.random.default_rng(1))
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    for rotation in (turns, half_turns):
        ours = quaternions(rotation.as_matrix())
        np.testing.assert_allclose(np.abs(np.sum(ours * rotation.as_quat(), axis=1)), 1.0, atol=1e-12)
    for normal in [*Rotation.random(50, rng=np.random.default_rng(2)).apply([0, 0, 1]), [0, 0, -1.0]]:
        turn = Rotation.from_quat(quaternion_of_normal(np.asarray(normal)))
        np.testing.assert_allclose(turn.apply([0, 0, 1]), normal, atol=1e-7)


def test_ring_frames_move_with_the_ring():
    ring = records.shape(0.0, 0, np.random.default_rng(0)).reshape(4, 3)[:3]
    turn, shift = Rotation.random(rng=np.random.default_rng(3)), np.array([0.1, -0.2, 0.3])
    centre, quaternion = ring_frames((turn.apply(ring) + shift)[None])
    np.testing.assert_allclose(centre[0], shift, atol=1e-15)
    np.testing.assert_allclose((Rotation.from_quat(quaternion[0]) * turn.inv()).magnitude(), 0, atol=1e-7)


def _xyz(vector):
    return [vector.x, vector.y, vector.z]


def _points(line):
    return np.array([_xyz(point) for point in line.points])


def _messages(path: Path, topic: str):
    with open(path, "rb") as stream:
        for schema, _, message in make_reader(stream).iter_messages(topic, log_time_order=False):
            yield schema, message


def _decoded(schema, message):
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(message.data)
