"""Rig files: what they may say, how they fit robots, and how an experiment gets onto a rig."""

from __future__ import annotations

import json
import re

import pytest

from tcrctl.cli.app import main
from tcrctl.cli.rig.verbs import RIG_VERBS
from tcrctl.config import shipped, strict_yaml
from tcrctl.errors import InputError, SpecError, UnknownNameError
from tcrctl.experiment.provenance import attachments
from tcrctl.experiment.spec import ExperimentSpec, load_spec
from tcrctl.plant.rig.file import load_rig, read_rig
from tcrctl.plant.rig.settings import RigFile
from tcrctl.plant.settings import RigSettings
from tcrctl.robot.description import load_robot

LOOPBACK = ("plant.kind=rig", "plant.rig=loopback")


@pytest.mark.parametrize("name", shipped.rigs())
def test_every_shipped_rig_fits_its_robots(name):
    rig, path, given, _ = read_rig(name)
    assert rig.name == name == path.stem
    for robot in rig.robots:
        loaded = load_rig(name, load_robot(robot))
        assert (loaded.robot, loaded.given) == (robot, given)
        assert set(loaded.mounted.cables) <= {f"c{i}" for i in range(1, 7)}


def changed(tmp_path, old, new):
    text = shipped.rigs()["loopback"].read_text()
    assert old in text
    path = tmp_path / "own.yaml"
    path.write_text(text.replace(old, new, 1))
    return str(path)


MISTAKES = {
    "two drives on one axis": ("c2: {axis: 2", "c2: {axis: 1", "axis 1 already drives cable c1"),
    "limits the wrong way round": (
        "min_mm: -30, max_mm: 90",
        "min_mm: 90, max_mm: -30",
        "greater than min_mm",
    ),
    "unknown antagonist": ("[c1, c2, c3]", "[c1, c2, c7]", "there is no cable c7; known: c1, c2, c3"),
    "no such brace": ("tcr600_m{ring}.n{node}", "tcr600_m{row}.n{node}", "may contain {ring} and {node}"),
    "no rotation": ("[0.6532814824, ", "[0.9, ", "must have length 1"),
    "half an identity": (
        "n{node}', base",
        "n{node}', nodes: [{node: m1.n1, asset: 3}], base",
        "belong together",
    ),
    "two identities": (
        "n{node}', base",
        "n{node}', nodes: [{node: m1.n1, label: a.b, asset: 3, member: 1}], base",
        "not both",
    ),
    "unknown key": ("up_axis: y", "up: y", "unknown key"),
    "wrong kind": ("kind: natnet", "kind: vicon", "must be 'natnet'"),
    "times the wrong way round": (
        "stale_stop_ms: 400",
        "stale_stop_ms: 40",
        "greater than stale_after_ms, 100",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_a_rig_file_has_its_place(name, tmp_path):
    old, new, message = MISTAKES[name]
    path = changed(tmp_path, old, new)
    with pytest.raises(SpecError) as caught:
        read_rig(path)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert re.match(rf"{re.escape(path)}:\d+:\d+$", problem.where)


MISFITS = {
    "cable without drive": ("      c3: {axis: 3, min_mm: -30, max_mm: 90}\n", "", "c3"),
    "drive without cable": (
        "cables:\n",
        "cables:\n      c0: {axis: 6, min_mm: -1, max_mm: 1}\n",
        "no cable c0",
    ),
    "wider than the robot": ("min_mm: -30", "min_mm: -130", "stroke_mm of tcr600, -100 to 200"),
    "ring that is not there": (
        "n{node}', base: 'tcr600",
        "n{node}', rings: [12], base: 'tcr600",
        "no ring 12",
    ),
}


@pytest.mark.parametrize("name", MISFITS)
def test_a_rig_file_is_held_against_the_robot(name, tmp_path):
    old, new, message = MISFITS[name]
    with pytest.raises(SpecError, match=message):
        load_rig(changed(tmp_path, old, new), load_robot("tcr600"))


def test_a_robot_that_does_not_hang_there_is_named():
    with pytest.raises(
        InputError, match="robot tcr5x4 does not hang on rig loopback; there hang: tcr600, tcr700"
    ):
        load_rig("loopback", load_robot("tcr5x4"))
    with pytest.raises(UnknownNameError, match="no rig named 'lopback'"):
        read_rig("lopback")


def test_the_same_experiment_file_runs_on_a_rig():
    simulated, rig = load_spec("letter_t"), load_spec("letter_t", LOOPBACK)
    assert rig.spec.plant == RigSettings(kind="rig", rig="loopback")
    assert rig.spec.model_copy(update={"plant": simulated.spec.plant}) == simulated.spec
    assert (simulated.rig, simulated.notes) == (None, ())
    assert rig.rig.rig.name == "loopback"
    assert attachments(rig, rig.spec)["rig.yaml"][1] == shipped.rigs()["loopback"].read_bytes()
    (note,) = rig.notes
    assert "plant.mismatch, plant.noise_um, plant.latency_ms: left out" in note


def test_only_keys_of_the_former_kind_that_the_file_gives_are_left_out(tmp_path):
    for override, message in (("plant.noise_um=20", "noise_um"), ("plant.nois=20", "nois")):
        with pytest.raises(SpecError, match=f"{message}: unknown key|{message}.*unknown key"):
            load_spec("letter_t", (*LOOPBACK, override))
    path = tmp_path / "typo.yaml"
    path.write_text(shipped.experiments()["letter_t"].read_text().replace("noise_um", "noise_mu"))
    with pytest.raises(SpecError, match="noise_mu"):
        load_spec(str(path), LOOPBACK)


def test_a_rig_path_starts_at_the_experiment_file_and_then_at_the_working_directory(tmp_path, monkeypatch):
    rig = changed(tmp_path, "name: loopback", "name: own")
    experiment = tmp_path / "mine.yaml"
    experiment.write_text(shipped.experiments()["letter_t"].read_text())
    assert load_spec(str(experiment), ("plant.kind=rig", "plant.rig=own.yaml")).rig.rig.name == "own"
    monkeypatch.chdir(tmp_path)
    assert load_spec("letter_t", ("plant.kind=rig", "plant.rig=own.yaml")).rig.path.resolve() == (
        tmp_path / rig
    )


def test_list_names_the_rigs_and_a_resolved_rig_experiment_loads_again(tmp_path, capsys):
    assert main(["list", "--json"]) == 0
    assert [rig["name"] for rig in json.loads(capsys.readouterr().out)["rigs"]] == list(shipped.rigs())
    assert main(["show", "letter_t", "--set", LOOPBACK[0], "--set", LOOPBACK[1]]) == 0
    text = capsys.readouterr().out
    again = strict_yaml.validate(strict_yaml.loads(text), ExperimentSpec)
    assert again == load_spec("letter_t", LOOPBACK).spec
    assert strict_yaml.validate(strict_yaml.load(shipped.rigs()["loopback"]), RigFile).name == "loopback"


@pytest.mark.slow
@pytest.mark.parametrize("verb", RIG_VERBS)
def test_every_rig_verb_explains_itself_with_an_example(verb, capsys):
    assert main(["rig", verb, "--help"]) == 0
    assert f"tcrctl rig {verb}" in capsys.readouterr().out.split("Example", 1)[1]


def test_verbs_of_one_robot_ask_which_one(capsys):
    assert main(["rig", "zero", "loopback", "--dry-run"]) == 2
    assert "hang tcr600, tcr700; choose one with --robot" in capsys.readouterr().err
    assert main(["rig", "zero", "loopback", "--robot", "tcr60", "--dry-run"]) == 2
    assert "Did you mean tcr600?" in capsys.readouterr().err


def test_the_schema_of_rig_files_knows_every_key_of_the_shipped_ones(capsys):
    assert main(["schema", "--rig"]) == 0
    schema = json.loads(capsys.readouterr().out)
    for path in shipped.rigs().values():
        assert set(strict_yaml.load(path).data) <= set(schema["properties"])
    assert {"robots", "cameras"} <= set(schema["required"])
    assert '"unit": "mm"' in json.dumps(schema)
    assert main(["schema", "--rig", "--robot"]) == 2
