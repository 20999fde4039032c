"""Runs on realistic plants: the same from the same seed, told in the log, replayed bit for bit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from support.short_runs import short_spec
from tcrctl.config import strict_yaml
from tcrctl.experiment.prepare import build_plant, plan, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import ExperimentSpec, load_spec
from tcrctl.log.file_names import CAMERAS, PLANT_ROBOT, RESOLVED
from tcrctl.log.reader import read_log
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.replay.replay import replay
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Command

pytestmark = pytest.mark.slow

MODERATE = "plant.realistic=moderate"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Experiment and log of a short realistic run."""
    experiment = prepare(short_spec(MODERATE, "plant.step_ms=2.5"), seed=11)
    return experiment, run_experiment(experiment, out=tmp_path_factory.mktemp("runs")).log


def commands(log):
    return b"".join(s.wanted.speed.tobytes() + s.measurement.nodes.tobytes() for s in read_log(log).steps())


def test_a_realistic_run_is_replayed_bit_for_bit(run):
    found = replay(run[1])
    assert found.status == "identical", found.reason
    assert found.compared > 10


def test_a_run_on_drives_that_count_and_start_elsewhere_is_replayed_bit_for_bit(tmp_path):
    drives = "plant.drives={quantisation_mm: 0.0137, lag_s: 0.05, zero_error_mm: 0.5}"
    start = "plant.start_drives_mm=[1.003, -0.5, 0.25]"
    spec = short_spec(drives, start, "plant.step_ms=2.5", "controller.speed_limit_mm_s=4")
    found = replay(run_experiment(prepare(spec), out=tmp_path).log)
    assert found.status == "identical", found.reason
    assert not any("applied" in reason for reason in found.not_compared)


def test_the_log_holds_what_was_drawn(run):
    experiment, path = run
    log = read_log(path)
    resolved = strict_yaml.validate(strict_yaml.loads(log.attachments[RESOLVED][1]), ExperimentSpec)
    assert resolved == experiment.spec
    assert resolved.plant.realistic_seed == 11
    assert len(resolved.plant.drives.zero_error_mm) == 3
    robot = strict_yaml.validate(strict_yaml.loads(log.attachments[PLANT_ROBOT][1]), RobotDescription)
    assert len(robot.modules.each) == 11
    plant, _ = build_plant(experiment)
    assert isinstance(plant, SimulatedPlant)
    soft = resolved.plant.mismatch
    np.testing.assert_allclose(
        build_robot(robot).model.mass * soft.density, plant.robot.model.mass, rtol=1e-12, atol=1e-15
    )
    cameras = json.loads(log.attachments[CAMERAS][1])
    np.testing.assert_allclose(np.linalg.norm(cameras["marker_bias_mm"], axis=1), 1.0)
    assert np.linalg.norm(cameras["frame_rotation_deg"]) == pytest.approx(0.25)
    np.testing.assert_allclose(
        1e-3 * np.array(cameras["marker_bias_mm"]), plant.reality.cameras.draw.bias, rtol=0, atol=1e-15
    )


def test_the_resolved_file_is_the_same_run_again_whatever_the_seed_draws(run, tmp_path):
    experiment, path = run
    file = tmp_path / "again.yaml"
    file.write_bytes(read_log(path).attachments[RESOLVED][1])
    again = prepare(load_spec(str(file)))
    assert again.spec.plant == experiment.spec.plant
    one, other = build_plant(experiment)[0], build_plant(again)[0]
    still = Command(np.zeros(3), np.zeros(3))
    for _ in range(5):
        assert np.array_equal(one.read().nodes, other.read().nodes)
        one.write(still)
        other.write(still)
    assert np.array_equal(one.truth().q, other.truth().q)


def test_the_same_seed_is_the_same_run_and_another_one_is_not(run, tmp_path):
    again = prepare(short_spec(MODERATE, "plant.step_ms=2.5"), seed=11)
    assert commands(run_experiment(again, out=tmp_path).log) == commands(run[1])
    other = prepare(short_spec(MODERATE, "plant.step_ms=2.5"), seed=12)
    assert other.spec.plant.drives != again.spec.plant.drives


def test_a_drawn_plant_begins_at_rest(run):
    plant, _ = build_plant(run[0])
    start = plant.truth()
    np.testing.assert_allclose(plant.read().drive, 0.0, atol=1e-15)
    for _ in range(20):
        plant.write(Command(np.zeros(3), np.zeros(3)))
    np.testing.assert_allclose(plant.truth().q, start.q, rtol=0, atol=2e-6)
    np.testing.assert_allclose(plant.truth().tension, start.tension, rtol=0, atol=1e-3)


def test_feasibility_is_that_of_the_controllers_robot(run):
    plain = plan(prepare(short_spec()))
    np.testing.assert_array_equal(plan(run[0]).drive, plain.drive)


def test_show_tells_what_will_be_drawn(capsys):
    from tcrctl.cli import app

    app.main(["show", "letter_t", "--set", MODERATE, "--set", "seed=5", "--json"])
    shown = json.loads(capsys.readouterr().out)["plant"]
    assert shown["realistic_seed"] == 5
    assert shown["friction"]["coefficient"] == 0.1
    assert len(shown["drives"]["radius_error"]) == 3


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [3, 11])
def test_a_robot_that_contracts_and_looks_sideways_is_believed(tmp_path, seed):
    """`box_scan`: joints give 14 mm along the body and bend by 30 degrees, a marker in twenty is lost."""
    spec = load_spec("box_scan", overrides=[MODERATE, f"plant.realistic_seed={seed}"])
    summary = run_experiment(prepare(spec), out=tmp_path)
    told = [event.message for event in read_log(summary.log).events() if event.kind == "picture"]
    assert summary.status != "aborted"
    assert told == []
