"""The whole way on a small simulated robot: excite, identify, run; each log is what the next step reads."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tcrctl.cli.app import main
from tcrctl.config import strict_yaml
from tcrctl.estimator.calibration_settings import CalibrationSettings
from tcrctl.experiment.prepare import build_parts, build_plant, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.identify.calibration.files import CALIBRATION, REPORT, write_calibration
from tcrctl.identify.calibration.rests import read_rests
from tcrctl.identify.calibration.rubbing import Pulls
from tcrctl.identify.calibration.self_calibration import calibrate
from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.log.file_names import CAMERAS
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay
from tcrctl.robot.description import load_robot

SEED = 5
EXCITATION = (
    "robot=tcr5x4",
    "trajectory={kind: excitation, poses: 14, held_out: 3, rest_s: 1.6, lead_in_s: 2, settle_s: 1, pulls: "
    "{size_mm: 3, move_s: 0.5, rest_s: 1.6}, draw: {contraction_mm: [0, 20], reach_mm: [3, 15], floor_n: 1.5}}",
    "plant.step_ms=2.5",
)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What was found in the log of an excitation, and the folder of its files."""
    out = tmp_path_factory.mktemp("calibration")
    summary = run_experiment(prepare(load_spec("excitation", EXCITATION), seed=SEED), out=out)
    calibrated = calibrate(summary.log, SelfCalibrationSpec(friction=False))
    robot, calibration = write_calibration(calibrated, out)
    return calibrated, robot, calibration


def calibrated_spec(found, *overrides):
    """A short stay with the robot and the cameras as found, on the plant of the excitation."""
    _, robot, calibration = found
    return load_spec(
        "excitation",
        (
            *EXCITATION,
            f"robot={robot}",
            "plant.robot=tcr5x4",
            f"estimator.calibration={calibration}",
            "trajectory={kind: hold, duration_s: 1.0}",
            "controller={kind: ioc}",
            *overrides,
        ),
    )


@pytest.mark.slow
def test_poses_that_were_not_used_are_predicted_far_better(found):
    result = found[0].result
    assert result.fit.converged
    assert result.held_out.end_mean < 0.4 * result.held_out_before.end_mean


@pytest.mark.slow
def test_the_frame_of_the_cameras_is_found(found):
    result = found[0].result
    drawn = json.loads(read_log(found[0].log.path).attachments[CAMERAS][1])
    part = result.unknowns.of("frame_rotation")
    off = np.degrees(result.fit.x[part]) - drawn["frame_rotation_deg"]
    deviation = np.degrees(np.sqrt(np.diag(result.fit.covariance))[part])
    assert np.abs(off / deviation).max() < 4.0


@pytest.mark.slow
def test_the_lag_of_the_drives_is_found(found):
    assert found[0].result.drives.lag == pytest.approx(0.03, abs=2e-3)
    assert found[0].result.drives.dead_time == pytest.approx(0.0, abs=2e-3)


@pytest.mark.slow
def test_pulls_count_beside_the_first_rest_wherever_that_came_from(found):
    """On a bench a run before may have left the drives elsewhere: the first rest comes after a pull, too."""
    calibrated = found[0]
    settings, x = calibrated.spec.rest, calibrated.result.fit.x
    rests = read_rests(calibrated.log, settings)
    slid = rests.slid.copy()
    slid[0] = 1.0
    left = [
        Pulls(calibrated.log, which, calibrated.body, x, settings).left(np.zeros(4))
        for which in (rests, replace(rests, slid=slid))
    ]
    np.testing.assert_array_equal(*left)


@pytest.mark.slow
def test_the_files_say_what_was_found(found):
    calibrated, robot, calibration = found
    assert calibration.name == CALIBRATION
    assert load_robot(str(robot)).name == "tcr5x4_calibrated"
    report = json.loads((calibration.parent / REPORT).read_text())
    assert report["parameters"]["tension"]["value"] == pytest.approx(
        calibrated.result.fit.x[calibrated.result.unknowns.of("tension")][0]
    )
    assert report["unidentifiable"]
    said = strict_yaml.load(calibration).data
    assert len(said["markers_mm"]) == 15


@pytest.mark.slow
def test_the_robot_that_was_found_hangs_where_the_plant_does(found):
    experiment = prepare(calibrated_spec(found), seed=SEED)
    plant, state = build_plant(experiment)
    true, designed = plant.truth().position, prepare(load_spec("excitation", EXCITATION), seed=SEED).robot
    after = np.linalg.norm(experiment.robot.rest_position - true)
    assert after < 0.4 * np.linalg.norm(designed.rest_position - true)
    _, offset = build_parts(experiment, plant, state)
    assert offset < 2e-3


@pytest.mark.slow
def test_a_calibrated_run_is_replayed_bit_for_bit_without_its_files(found, tmp_path):
    log = run_experiment(prepare(calibrated_spec(found), seed=SEED), out=tmp_path).log
    again = replay(log)
    assert again.status == "identical", again.reason
    assert again.compared > 10
    uncalibrated = replay(log, overrides=["estimator.calibration=off"])
    assert uncalibrated.status == "different"


@pytest.mark.slow
def test_the_verb_finds_the_same_and_says_where_its_files_are(found, tmp_path, capsys):
    log = str(found[0].log.path.parent)
    assert (
        main(["identify", "--calibrate", log, "--set", "friction=false", "--out", str(tmp_path), "--json"])
        == 0
    )
    said = json.loads(capsys.readouterr().out)
    assert said["status"] == "success"
    assert said["parameters"]["springs"]["value"] == pytest.approx(found[0].result.fit.x[0], rel=1e-6)
    assert strict_yaml.validate(strict_yaml.load(said["calibration_file"]), CalibrationSettings).markers_mm


@pytest.mark.slow
def test_a_designed_excitation_runs_with_the_poses_that_were_chosen(tmp_path, capsys):
    given = load_spec("excitation", EXCITATION).spec.model_dump(mode="json")
    given["trajectory"]["poses"], given["trajectory"]["poses_mm"] = 4, []
    file = tmp_path / "mine.yaml"
    file.write_text(strict_yaml.dumps(given))
    assert main(["identify", "--design", str(file), "--out", str(tmp_path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["information"] >= said["information_drawn"]
    spec = load_spec(said["excitation_file"]).spec
    assert len(spec.trajectory.poses_mm) == said["poses"] == 4


def test_a_verb_that_is_told_two_things_at_once_refuses(capsys):
    assert main(["identify", "--calibrate", "a", "--design", "b"]) == 2
    assert "stand alone" in capsys.readouterr().err
