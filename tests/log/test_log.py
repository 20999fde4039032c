"""Laws of a finished log: bit-exact round trip and layout."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Message, Metadata
from mcap.stream_reader import StreamReader

from support import records
from support.log_files import STOP, doctor, open_log
from tcrctl.errors import InputError, LogError, UnknownNameError
from tcrctl.log.columns import COLUMNS, stack
from tcrctl.log.reader import read_log
from tcrctl.log.schema import descriptor_set, public_descriptor
from tcrctl.log.seal import sealed
from tcrctl.log.steps import StepDecoder, StepEncoder
from tcrctl.log.viewer_topics import TOPICS
from tcrctl.signals import RawFrame


@pytest.fixture
def finished(tmp_path):
    path = tmp_path / "log.mcap"
    with open_log(path, flush_steps=7) as log:
        for k in range(40):
            log.step(records.record(k))
            if k == 20:
                log.event(records.record(k).t, "limit", "warning", "cable c1 at its speed limit")
        log.finish(STOP)
    return path


def reencoded_as_stored(name):
    """Message class made from nothing but the schema bytes that the file holds."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(public_descriptor(name)))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"tcrctl.v1.{name}"))


@pytest.mark.slow
@given(records.steps())
@settings(max_examples=80, deadline=None)
def test_a_step_survives_encoding_bit_for_bit(step):
    decoded = StepDecoder().decode(StepEncoder().encode(step))
    assert records.fingerprint(decoded) == records.fingerprint(step)


@pytest.mark.slow
@given(records.steps())
@settings(max_examples=40, deadline=None)
def test_the_stored_schema_gives_viewers_the_same_numbers(step):
    seen = reencoded_as_stored("Step").FromString(StepEncoder().encode(step))
    assert seen.k == step.k
    np.testing.assert_array_equal(np.array(seen.estimate.q), step.estimate.q)
    np.testing.assert_array_equal(np.array(seen.measurement.nodes), step.measurement.nodes.ravel())
    assert list(seen.info.saturated) == step.info.saturated.tolist()
    assert math.copysign(1.0, seen.timing.read) == math.copysign(1.0, step.timing.read) or math.isnan(
        seen.timing.read
    )
    assert seen.HasField("truth") == (step.truth is not None)


@pytest.mark.slow
@given(records.steps())
@settings(max_examples=25, deadline=None)
def test_arbitrary_steps_survive_a_file_bit_for_bit(tmp_path_factory, step):
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    with open_log(path) as log:
        log.step(step)
        log.finish(STOP)
    assert [records.fingerprint(s) for s in read_log(path).steps()] == [records.fingerprint(step)]


def test_an_array_of_another_type_is_refused_instead_of_cast(tmp_path):
    wrong = records.record(0)
    object.__setattr__(wrong.measurement, "nodes", wrong.measurement.nodes.astype(np.float64))
    log = open_log(tmp_path / "log.mcap")
    log.step(wrong)
    with pytest.raises(LogError, match=r"Measurement\.nodes is float64"):
        log.finish(STOP)


@pytest.mark.parametrize("t", [np.nan, np.inf, 1e300, -1e300])
def test_a_measurement_without_a_sane_time_keeps_it_and_a_step_without_one_is_refused(tmp_path, t):
    step = records.record(0)
    object.__setattr__(step.measurement, "t", t)
    with open_log(tmp_path / "good.mcap") as log:
        log.step(step)
        log.finish(STOP)
    assert [records.fingerprint(s) for s in read_log(log.path).steps()] == [records.fingerprint(step)]
    object.__setattr__(step, "t", t)
    log = open_log(tmp_path / "bad.mcap")
    log.step(step)
    with pytest.raises(LogError, match="not a time"):
        log.finish(STOP)


def test_a_plain_mcap_reader_sees_every_step_once_in_order(finished):
    with open(finished, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = [message for _, _, message in reader.iter_messages("/tcrctl/step", log_time_order=False)]
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        header = reader.get_header()
    assert [message.sequence for message in messages] == list(range(40))
    assert all(
        message.log_time == records.EPOCH_NS + round(k * records.PERIOD_S * 1e9)
        for k, message in enumerate(messages)
    )
    assert all(message.publish_time == message.log_time - 10_000_000 for message in messages)
    assert metadata["tcrctl.run.start"]["run_id"] == records.START["run_id"]
    stop = metadata["tcrctl.run.stop"]
    assert stop == sealed("tcrctl.run.stop", {"steps": "40", **STOP})
    assert header.profile == ""
    assert header.library.startswith("tcrctl/")


def test_attachments_and_start_come_first_and_stop_last(finished):
    kinds = []
    with open(finished, "rb") as stream:
        for record in StreamReader(stream).records:
            if isinstance(record, Attachment | Metadata):
                kinds.append(record.name)
            elif isinstance(record, Message) and kinds[-1:] != ["messages"]:
                kinds.append("messages")
    assert kinds == [*records.ATTACHMENTS, "tcrctl.run.start", "messages", "tcrctl.run.stop"]


def test_the_reader_gives_back_what_was_logged(finished):
    log = read_log(finished)
    assert log.complete
    assert log.attachments == records.ATTACHMENTS
    assert log.stop is not None
    assert log.stop["status"] == "success"
    assert log.node_names[:5] == ("base.n1", "base.n2", "base.n3", "base.apex", "m1.n1")
    assert log.cable_names == ("c1", "c2", "c3")
    assert [(e.kind, e.level, e.message) for e in log.events()] == [
        ("log", "info", "log opened"),
        ("limit", "warning", "cable c1 at its speed limit"),
    ]
    expected = [records.fingerprint(records.record(k)) for k in range(40)]
    assert [records.fingerprint(step) for step in log.steps()] == expected


def test_every_unit_of_the_step_is_in_the_channel_metadata(finished):
    with open(finished, "rb") as stream:
        channels = make_reader(stream).get_summary().channels.values()
    step: Channel = next(channel for channel in channels if channel.topic == "/tcrctl/step")
    for column in COLUMNS.values():
        assert step.metadata.get(f"unit.{column.path}", "") == column.unit
    derived = {channel.topic for channel in channels if channel.metadata.get("derived") == "true"}
    assert derived == {"/log", *TOPICS}


@pytest.mark.slow
def test_an_independent_checker_finds_no_fault(finished, tmp_path):
    assert doctor(finished).returncode == 0, doctor(finished).stdout
    empty = tmp_path / "empty.mcap"
    with open_log(empty) as log:
        log.finish(STOP)
    assert doctor(empty).returncode == 0, doctor(empty).stdout
    assert list(read_log(empty).steps()) == []
    assert read_log(empty).complete


def test_columns_are_the_steps_stacked(finished):
    log = read_log(finished)
    columns = log.columns()
    steps = list(log.steps())
    assert set(columns) == {name for name in COLUMNS if not name.startswith("measurement_raw_")}
    np.testing.assert_array_equal(columns["estimate_q"], [step.estimate.q for step in steps])
    np.testing.assert_array_equal(columns["k"], np.arange(40))
    assert columns["measurement_nodes"].dtype == np.float32
    assert columns["measurement_nodes"].shape == (40, 9, 3)
    assert set(log.columns(["t", "truth_q"])) == {"t", "truth_q"}
    with pytest.raises(UnknownNameError):
        log.columns(["position_of_the_moon"])


def test_columns_pad_what_some_steps_lack(tmp_path):
    path = tmp_path / "log.mcap"
    with_normal, without = records.record(0), records.record(1)
    for name in ("normal", "ahead_normal"):
        object.__setattr__(without.reference, name, None)
    object.__setattr__(without, "truth", None)
    with open_log(path) as log:
        log.step(with_normal)
        log.step(without)
        log.finish(STOP)
    columns = read_log(path).columns()
    assert np.isnan(columns["reference_normal"][1]).all()
    np.testing.assert_array_equal(columns["reference_normal"][0], with_normal.reference.normal)
    assert np.isnan(columns["truth_q"][1]).all()


def test_what_is_not_a_log_is_named_as_such(tmp_path):
    from mcap.writer import Writer

    foreign, text, nothing = (tmp_path / name for name in ("foreign.mcap", "text.mcap", "nothing.mcap"))
    with open(foreign, "wb") as stream:
        writer = Writer(stream)
        writer.start(library="someone else")
        writer.finish()
    text.write_text("t,x\n0,1\n")
    nothing.write_bytes(b"")
    cases = {
        foreign: "not a log of tcrctl",
        text: "not an MCAP file",
        nothing: "is empty",
        tmp_path: "cannot be read",
        tmp_path / "missing.mcap": "No such file",
    }
    for path, message in cases.items():
        with pytest.raises(InputError, match=message) as caught:
            read_log(path)
        assert caught.value.exit_code == 2


def test_columns_of_camera_frames_have_a_gap_where_no_frame_came():
    raw = RawFrame(
        7, 0, 0.004, np.array([1, 2], np.int32), np.ones((2, 3), np.float32), np.zeros(2, np.int32)
    )
    steps = [records.record(k) for k in range(3)]
    steps[1] = replace(steps[1], measurement=replace(steps[1].measurement, raw=raw))
    names = [name for name in COLUMNS if name.startswith("measurement_raw_")]
    columns = stack(steps, names)
    assert [*columns, "measurement_raw_names"] == names  # these markers have numbers, no names
    assert columns["measurement_raw_number"].tolist() == [-1, 7, -1]
    assert columns["measurement_raw_ids"].tolist() == [[-1, -1], [1, 2], [-1, -1]]
    assert np.isnan(columns["measurement_raw_positions"]).all(axis=(1, 2)).tolist() == [True, False, True]
    assert stack(steps[:1], names) == {}
