"""``tcrctl identify``: one JSON object, a folder of results, a robot file that runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.identify_data import CABLES, LONG, MASS, ROBOT, SPRINGS, static_data, true_robot
from tcrctl.cli.app import main
from tcrctl.config import shipped, strict_yaml
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.robot.description import load_robot

pytestmark = pytest.mark.slow

KEYS = {
    "status",
    "mean_error_before_mm",
    "mean_error_after_mm",
    "held_out_error_mm",
    "parameters",
    "unidentifiable",
    "evaluations",
    "seconds",
    "robot_file",
}
DRIVE = """
name: drive
robot: tcr5x4
trajectory:
  kind: drives
  lead_in_s: 0.1
  settle_s: 0.4
  legs: [{drives_mm: [20, 5, -5, 5], duration_s: 0.5, motion: constant_speed}]
controller: {kind: open_loop, period_s: 0.05, speed_limit_mm_s: 50}
plant:
  kind: simulated
  noise_um: 100
  latency_ms: 10
  mismatch: {springs_youngs_modulus: 0.75, cables_youngs_modulus: 1.2}
safety: {position_error_mm: 500}
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Log of a short run of a robot with softer springs and stiffer cables."""
    folder = tmp_path_factory.mktemp("drive")
    (folder / "drive.yaml").write_text(DRIVE)
    return run_experiment(prepare(load_spec(str(folder / "drive.yaml"))), out=folder).log


def answer(capsys, *arguments):
    """Exit code and the one object on stdout."""
    code = main(["identify", *map(str, arguments), "--json", "--jobs", "1"])
    captured = capsys.readouterr()
    return code, json.loads(captured.out), captured.err


@pytest.fixture
def data(tmp_path):
    path = tmp_path / "data.yaml"
    path.write_text(strict_yaml.dumps(static_data(true_robot(LONG, springs=0.75, cables=1.2), noise_mm=0.1)))
    return path


def test_static_data_become_a_robot_file_that_runs(capsys, tmp_path, data, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, found, said = answer(
        capsys,
        "--from",
        data,
        "--robot",
        LONG,
        "--params",
        f"{SPRINGS},{CABLES}",
        "--method",
        "least-squares",
    )
    assert (code, found["status"]) == (0, "success")
    assert set(found) >= KEYS
    assert found["unidentifiable"] == []
    assert found["parameters"][SPRINGS]["value"] == pytest.approx(67.5, rel=0.02)
    assert "2 parameters, 5 configurations" in said
    file = Path(found["robot_file"])
    assert load_robot(str(file)).springs.youngs_modulus_mpa == found["parameters"][SPRINGS]["value"]
    assert {path.name for path in file.parent.iterdir()} == {
        "robot.yaml",
        "report.json",
        "figure.png",
        "spec.yaml",
        "spec.resolved.yaml",
    }
    assert json.loads((file.parent / "report.json").read_text())["data_sha256"] == found["data_sha256"]
    assert (
        load_spec("letter_t", [f"robot={file}"]).robot.name == f"{LONG}_identified"
    )  # relative to where we are


def test_the_new_robot_file_keeps_every_comment_and_says_where_it_comes_from(capsys, tmp_path, data):
    _, found, _ = answer(
        capsys,
        "--from",
        data,
        "--robot",
        LONG,
        "--params",
        SPRINGS,
        "--method",
        "least-squares",
        "--out",
        tmp_path,
    )
    text = Path(found["robot_file"]).read_text()
    for line in shipped.robots()[LONG].read_text().splitlines():
        if "youngs_modulus_mpa: 90" not in line and "name: tcr700" not in line:
            assert line in text
    assert found["data_sha256"] in text
    assert "seed 0" in text
    assert "mm after" in text


def test_a_log_gives_the_parameters_of_the_robot_that_moved(capsys, tmp_path, log):
    code, found, _ = answer(
        capsys,
        "--from",
        log,
        "--robot",
        ROBOT,
        "--params",
        f"{SPRINGS},{CABLES}",
        "--method",
        "least-squares",
        "--out",
        tmp_path,
    )
    assert (code, found["strung_by"]) == (0, "length")  # the plant kept its rest lengths
    assert found["parameters"][SPRINGS]["value"] == pytest.approx(0.75 * 90, rel=0.05)
    assert found["parameters"][CABLES]["value"] == pytest.approx(1.2 * 2300, rel=0.05)
    assert len(found["configurations"]) == 4  # one log is held out quarter by quarter
    assert found["held_out_error_mm"] < 1.2 * found["mean_error_after_mm"]
    robot = load_robot(found["robot_file"])
    assert all(route.rest_length_mm is not None for route in robot.cables.routes)


def test_freeing_the_mass_is_answered_with_a_warning(capsys, tmp_path, data):
    code, found, said = answer(
        capsys,
        "--from",
        data,
        "--robot",
        LONG,
        "--params",
        f"{SPRINGS},{CABLES},{MASS}",
        "--method",
        "least-squares",
        "--out",
        tmp_path,
    )
    assert code == 0
    assert any(set(entry["combination"]) == {SPRINGS, CABLES, MASS} for entry in found["unidentifiable"])
    assert "warning: " in said
    assert MASS in said


def test_a_log_of_another_robot_is_refused(capsys, tmp_path, log):
    code, found, _ = answer(
        capsys, "--from", log, "--robot", "tcr700", "--params", SPRINGS, "--out", tmp_path / "out"
    )
    assert code == 2
    assert "is a log of another robot, tcr5x4: it has modules 5, tcr700 has 13" in found["reason"]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give one SPEC, not 0"),
        (["identify_table2", "--robot", "tcr700"], "belong to --from"),
        (["--from", "x.csv", "--robot", ROBOT], "--from needs --robot and --params"),
        (["--from", "x.csv", "--robot", ROBOT, "--params", SPRINGS], "x.csv: there is no such file"),
        (["identify_table2", "--method", "newton"], "--set method: must be 'pso+least-squares'"),
        (["identify_table3"], "there is no identification named 'identify_table3'"),
    ],
)
def test_wrong_usage_is_exit_code_2(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, found, _ = answer(capsys, *arguments)
    assert code == 2
    assert message in found["reason"]
    assert list(tmp_path.iterdir()) == []


def test_people_get_tables(capsys, tmp_path, data):
    arguments = ["--robot", LONG, "--params", SPRINGS, "--method", "least-squares", "--out", str(tmp_path)]
    assert main(["identify", "--from", str(data), *arguments, "--jobs", "1"]) == 0
    captured = capsys.readouterr()
    for words in (SPRINGS, "held out", "least-squares", "tcrctl run SPEC --set robot="):
        assert words in captured.out
    assert main(["identify", "--from", str(data), *arguments, "--jobs", "1", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_the_other_verbs_know_identifications(capsys):
    assert main(["validate", "identify_table2"]) == 0
    assert main(["run", "identify_table2", "--dry-run"]) == 2
    assert "tcrctl identify identify_table2" in capsys.readouterr().err
    assert main(["show", "identify_table2", "--set", "seed=9", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seed"] == 9
    assert main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed["identifications"]] == list(shipped.identifications())
    assert main(["schema", "--identification"]) == 0
    assert "parameters" in json.loads(capsys.readouterr().out)["properties"]
