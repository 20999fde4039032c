"""A run's folder holds everything to do it again, bit for bit, whatever its files' names mean meanwhile."""

from __future__ import annotations

import json

import pytest

from support.short_runs import SHORT, arguments
from tcrctl.cli.app import main
from tcrctl.config import shipped
from tcrctl.errors import InputError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.run_folder import link_latest
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log

pytestmark = pytest.mark.slow


def folder_of_run(out, spec, *more):
    assert main(["run", str(spec), "--out", str(out), "--quiet", "--json", *more]) == 0
    return (out / "latest").resolve()


def commands(folder):
    return b"".join(
        step.wanted.speed.tobytes() + step.truth.position.tobytes()
        for step in read_log(folder / "log.mcap").steps()
    )


@pytest.fixture
def own_spec(tmp_path):
    """An experiment on robots of its own, controller's and plant's, of which the user forgets what they were."""
    given = tmp_path / "given"
    given.mkdir()
    robot = shipped.robots()["tcr600"].read_text()
    (given / "robot.yaml").write_text(robot.replace("youngs_modulus_mpa: 90", "youngs_modulus_mpa: 95"))
    (given / "plant.yaml").write_text(robot.replace("youngs_modulus_mpa: 90", "youngs_modulus_mpa: 70"))
    text = shipped.experiments()["letter_t"].read_text().replace("robot: tcr600", "robot: ./robot.yaml")
    path = given / "mine.yaml"
    path.write_text(text.replace("  kind: simulated\n", "  kind: simulated\n  robot: ./plant.yaml\n"))
    return path


def test_a_run_is_done_again_from_its_folder_with_its_overrides_seed_and_robots(own_spec, tmp_path, capsys):
    more = [*arguments("controller.weights.speed_change=1000.0"), "--seed", "7"]
    first = folder_of_run(tmp_path / "a", own_spec, *more)
    for path in own_spec.parent.iterdir():
        path.unlink()
    second = folder_of_run(tmp_path / "b", first)
    assert commands(second) == commands(first)
    assert (second / "spec.resolved.yaml").read_bytes() == (first / "spec.resolved.yaml").read_bytes()
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (first, second)]
    assert summaries[0]["seed"] == summaries[1]["seed"] == 7
    assert summaries[0]["overrides"] == [*SHORT, "controller.weights.speed_change=1000.0"]
    third = folder_of_run(tmp_path / "c", second / "spec.resolved.yaml")
    assert commands(third) == commands(first)
    capsys.readouterr()


def test_what_the_user_gives_counts_more_than_what_lies_in_the_folder(tmp_path, capsys):
    folder = folder_of_run(tmp_path, "letter_t", *arguments())
    capsys.readouterr()
    again = load_experiment(str(folder), ["plant.noise_um=0", "robot=tcr5x4"])
    assert again.spec.plant.noise_um == 0
    assert again.robot.name == "tcr5x4"
    assert load_experiment(str(folder)).robot_path == folder / "robot.yaml"
    (folder / "robot.yaml").unlink()
    with pytest.raises(InputError, match="does not hold its robot"):
        load_experiment(str(folder))


def test_anything_else_is_loaded_as_ever():
    assert load_experiment("letter_t").spec == load_spec("letter_t").spec


def test_latest_follows_and_never_replaces_what_is_no_link(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        link_latest(tmp_path / name)
        assert (tmp_path / "latest").resolve() == tmp_path / name
    (tmp_path / "latest").unlink()
    (tmp_path / "latest").mkdir()
    link_latest(tmp_path / "a")
    assert not (tmp_path / "latest").is_symlink()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["a", "b", "latest"]
