"""The layout for the Foxglove app: what it names is what a run writes."""

from __future__ import annotations

import json
import re

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

import tcrctl
from tcrctl.cli.app import main
from tcrctl.view.layout import layout

#: Six cables, and a plant that knows the truth.
SIX = {
    "name": "six",
    "robot": "tcr700",
    "trajectory": {"kind": "hold", "duration_s": 0.2},
    "controller": {"kind": "kinematic"},
    "plant": {"kind": "simulated"},
}


@pytest.fixture(scope="module")
def last_messages(tmp_path_factory):
    """The last message of every topic of a log, decoded by the schema that the file carries."""
    run = tcrctl.run(SIX, out=tmp_path_factory.mktemp("run"))
    found, kinds = {}, {}
    with run.path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            kind = kinds.setdefault(schema.id, message_class(schema))
            found[channel.topic] = kind.FromString(message.data)
    return found


def message_class(schema):
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


def panels():
    return json.loads(layout())["configById"]


def named_topics():
    for panel in panels().values():
        yield from panel.get("topics", {})
        if "topicToRender" in panel:
            yield panel["topicToRender"]


def named_paths():
    return [path["value"] for panel in panels().values() for path in panel.get("paths", ())]


def value_at(messages, path):
    """What a message path stands for: ``/topic.field.field[3]``."""
    topic, *fields = path.split(".")
    value = messages[topic]
    for name, index in (re.fullmatch(r"(\w+)(?:\[(\d+)\])?", field).groups() for field in fields):
        value = getattr(value, name)
        value = value if index is None else value[int(index)]
    return value


@pytest.mark.slow
def test_every_topic_and_field_of_the_layout_is_in_the_log_of_a_run(last_messages):
    assert set(named_topics()) - set(last_messages) == set()
    paths = named_paths()
    assert len(paths) > 20
    assert all(isinstance(value_at(last_messages, path), bool | float | int) for path in paths)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["/tcrctl/step.applied.pace[0]", "/tcrctl/step.applied.speed[6]"])
def test_a_path_that_is_not_in_the_log_would_be_noticed(last_messages, wrong):
    with pytest.raises((AttributeError, IndexError)):
        value_at(last_messages, wrong)


def test_every_panel_has_a_place_and_every_place_a_panel():
    def leaves(node):
        return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]

    assert sorted(leaves(json.loads(layout())["layout"])) == sorted(panels())


def test_the_command_prints_the_layout(capsys):
    assert main(["play", "--layout"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(layout())
