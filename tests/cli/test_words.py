"""What a beginner is told: what a file is, which one was meant, what to type next."""

from __future__ import annotations

import json
import shlex
import shutil

import pytest

from support import records
from support.log_files import open_log
from tcrctl.cli.app import main
from tcrctl.config import shipped
from tcrctl.experiment.headline import count, headline
from tcrctl.plant.rig.loopback import emulate_hint
from tcrctl.robot.description import load_robot
from tcrctl.robot.doubts import doubts


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(capsys, *arguments):
    code = main(list(arguments))
    return code, capsys.readouterr()


@pytest.mark.parametrize(
    ("kind", "name", "use"),
    [("a robot file", "tcr600", "robot: my.yaml"), ("a rig file", "loopback", "rig: my.yaml")],
)
def test_a_file_of_another_kind_is_recognised(here, capsys, kind, name, use):
    shutil.copy((shipped.robots() | shipped.rigs())[name], "my.yaml")
    for verb in (["run", "my.yaml", "--dry-run"], ["validate", "my.yaml"]):
        code, printed = said(capsys, *verb)
        assert code == 2
        assert f"my.yaml: this is {kind}" in printed.err
        assert use in printed.err
        assert printed.err.count("\n") <= 2


#: Verbs that want a file of one kind, and a file of another: what it is, what is wanted, what else is said.
SWAPPED = {
    "rig check my.yaml --dry-run": (
        "tcr600",
        "a robot file",
        "a rig file",
        "tcrctl validate --robot my.yaml",
    ),
    "emulate my.yaml": ("letter_t", "an experiment", "a rig file", "tcrctl run my.yaml"),
    "validate --robot my.yaml": ("letter_t", "an experiment", "a robot file", "tcrctl run my.yaml"),
    "workspace my.yaml": ("loopback", "a rig file", "a robot file", "tcrctl rig check my.yaml"),
    "run letter_t --dry-run --set robot=my.yaml": (
        "letter_i",
        "an experiment",
        "a robot file",
        "--set robot: ",
    ),
}


@pytest.mark.parametrize("line", SWAPPED)
def test_so_it_is_by_every_verb(here, capsys, line):
    name, found, wanted, use = SWAPPED[line]
    shutil.copy((shipped.robots() | shipped.rigs() | shipped.experiments())[name], "my.yaml")
    code, printed = said(capsys, *line.split())
    assert code == 2
    assert f"my.yaml: this is {found}, not {wanted}" in printed.err
    assert use in printed.err
    assert printed.err.count("error: ") == 1


def test_so_is_a_log_and_a_folder(here, capsys):
    with open_log(here / "log.mcap") as log:
        log.step(records.record(0))
    shutil.copy("log.mcap", "log.yaml")
    assert "this is a log" in said(capsys, "run", str(here / "log.mcap"))[1].err
    assert "this is a log" in said(capsys, "run", "log.yaml")[1].err
    assert "is a folder" in said(capsys, "run", f"{here}/")[1].err


def test_a_file_of_this_folder_is_suggested_before_a_shipped_name(here, capsys):
    shutil.copy(shipped.experiments()["letter_t"], "letter_x.yaml")
    for name in ("letter_x", "leter_x"):
        code, printed = said(capsys, "run", name)
        assert code == 2
        assert "Did you mean letter_x.yaml" in printed.err
    assert "Did you mean letter_" in said(capsys, "run", "letter_tt")[1].err


def test_of_two_files_of_one_name_it_is_said_which(here, capsys):
    assert said(capsys, "validate", "letter_t")[1].err == ""
    shutil.copy(shipped.experiments()["letter_t"], "letter_t.yaml")
    code, printed = said(capsys, "validate", "letter_t", "--json")
    assert (code, json.loads(printed.out)["valid"]) == (0, ["letter_t"])
    assert "./letter_t.yaml in this folder is not read" in printed.err
    assert said(capsys, "validate", "letter_t.yaml")[1].err == ""


def test_new_makes_the_folder_it_is_told(here, capsys):
    assert said(capsys, "new", "studies/deep/x.yaml")[0] == 0
    assert said(capsys, "validate", "studies/deep/x.yaml")[0] == 0


def test_what_is_to_be_typed_next_can_be_typed(here, capsys):
    folder = here / "a folder; with $signs"
    folder.mkdir()
    with open_log(folder / "log.mcap") as log:
        log.step(records.record(0))
    path = folder / "cut.mcap"
    path.write_bytes((folder / "log.mcap").read_bytes()[:-40])
    code, printed = said(capsys, "info", str(path))
    assert code == 0
    shown = "".join(printed.out.split())  # a long path is folded
    assert "".join(f"mend it with: tcrctl recover {shlex.quote(str(path))}".split()) in shown


@pytest.mark.parametrize(
    ("change", "unit"),
    [
        ("modules.youngs_modulus_mpa=2.5e9", "Pa"),
        ("springs.youngs_modulus_mpa=9e7", "Pa"),
        ("modules.mass_g=0.01", "kg"),
        ("modules.mass_g=1e4", "mg"),
        ("modules.ring_diameter_mm=0.07", "m"),
        ("cables.diameter_mm=0.0008", "m"),
        ("springs.natural_length_mm=0.018", "m"),
    ],
)
def test_a_value_in_another_unit_gets_a_hint(change, unit, capsys):
    assert list(doubts(load_robot("tcr600"))) == []
    (hint,) = doubts(load_robot("tcr600", overrides=[change]))
    assert hint.startswith(change.partition("=")[0])
    assert f"is it in {unit}?" in hint
    code, printed = said(capsys, "validate", "--robot", "tcr600", "--set", change)
    assert code == 0
    assert hint in printed.err


def test_a_tip_that_is_not_the_last_ring_is_a_warning():
    assert "tip.ring: 5 is not the last ring, 11" in next(
        doubts(load_robot("tcr600", overrides=["tip.ring=5"]))
    )


def test_all_shipped_robots_are_usual():
    assert {name: list(doubts(load_robot(name))) for name in shipped.robots()} == {
        name: [] for name in shipped.robots()
    }


@pytest.mark.parametrize("where", ["127.0.0.1:15510", "PLC at localhost:502", "[::1]:502"])
def test_a_silent_device_of_this_computer_is_an_emulated_one(where):
    assert "tcrctl emulate" in emulate_hint(where)
    assert emulate_hint("192.168.127.1:502") == ""


@pytest.mark.parametrize("columns", ["0", "00", ""])
def test_no_columns_are_unknown_columns(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", columns)
    assert main(["export", "--columns"]) == 0
    assert "estimate_position" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("noun", "one", "several"), [("run", "1 run", "0 runs"), ("process", "1 process", "0 processes")]
)
def test_one_thing_is_told_in_the_singular(noun, one, several):
    assert (count(1, noun), count(0, noun)) == (one, several)


def test_one_late_step_and_a_study_of_one_run_are_told_in_the_singular(here, capsys):
    line = next(line for line in headline({"overruns": 1, "steps": 200}) if line.name == "overruns")
    assert line.text.startswith("1 step, 0.5 %")
    code, printed = said(capsys, "sweep", "letter_t", "--seeds", "0..0", "--dry-run")
    assert code == 0
    assert "1 run, 1 of them to be done" in printed.out + printed.err
