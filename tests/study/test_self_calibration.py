"""Runs that begin with a self-calibration on their own plant: found once, kept, and known by every run there."""

from __future__ import annotations

import json

import pytest

from support.engines import stay_here
from support.studies import quick_study, study_file
from tcrctl.cli.app import main
from tcrctl.config import strict_yaml
from tcrctl.errors import SpecError
from tcrctl.estimator.calibration_settings import CalibrationSettings
from tcrctl.executors.engine import Engine
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.experiment.unrecorded import run_unrecorded
from tcrctl.study.plan import planned
from tcrctl.study.self_calibration import FOLDER
from tcrctl.study.sweep import folder_of, sweep

EXCITATION = {
    "name": "short_excitation", "robot": "tcr600",  # as the shipped one: not that of the runs
    "trajectory": {
        "kind": "excitation", "poses": 7, "held_out": 0, "rest_s": 1.6, "lead_in_s": 1.0, "move_s": 1.0,
        "pulls": {"size_mm": 3.0, "move_s": 0.3, "rest_s": 0.2}, "settle_s": 1.0,
        "draw": {"contraction_mm": [0, 20], "reach_mm": [3, 15], "floor_n": 1.5},
    },
    "controller": {"kind": "open_loop"}, "plant": {"kind": "simulated"}, "safety": {"position_error_mm": 200},
}  # fmt: skip
STAY = {
    "name": "stay", "robot": "tcr5x4", "trajectory": {"kind": "hold", "duration_s": 0.5},
    "controller": {"kind": "ioc"}, "safety": {"position_error_mm": 60},
    "plant": {"kind": "simulated", "step_ms": 5.0, "noise_um": 50},
}  # fmt: skip
BIASED = {
    "plant.cameras": {"marker_bias_mm": 1.0, "frame_error": {"rotation_deg": 0.25, "translation_mm": 0.5}}
}


SETTINGS = [f"{key}={json.dumps(value)}" for key, value in BIASED.items()]


def camera_study(folder, **changes):
    for data in (EXCITATION, STAY):
        (folder / f"{data['name']}.yaml").write_text(strict_yaml.dumps(data))
    told = {
        "experiments": ["./stay.yaml"], "set": BIASED, "cases": {"plain": {}, "calibrated": {}}, "seeds": "1..2",
        "calibrate": {"cases": ["calibrated"], "excitation": "./short_excitation.yaml"},
    }  # fmt: skip
    return quick_study(folder, **{**told, **changes})


def swept(study, out):
    return sweep(study, planned(study), engine=Engine(1), out=out, logs="none")


@pytest.mark.slow
def test_runs_know_what_was_found_once_on_their_plant(tmp_path, monkeypatch):
    stay_here(monkeypatch)
    study = camera_study(tmp_path, seeds="2..2")
    done = swept(study, tmp_path)
    kept = sorted((folder_of(study, tmp_path) / FOLDER).iterdir())
    assert len(kept) == 1
    found = strict_yaml.validate(strict_yaml.load(kept[0]), CalibrationSettings)
    assert found.source == "short_excitation, seed 2"
    direct = load_spec(str(tmp_path / "stay.yaml"), (*SETTINGS, f"estimator.calibration={kept[0]}"))
    plain, calibrated = (row.result["position_error_mm"] for row in done.rows)
    assert run_unrecorded(prepare(direct, seed=2)).as_json()["position_error_mm"] == calibrated != plain
    time = kept[0].stat().st_mtime_ns
    (folder_of(study, tmp_path) / "rows.jsonl").unlink()
    again = swept(study, tmp_path)
    assert [row.result for row in again.rows] == [row.result for row in done.rows]
    assert kept[0].stat().st_mtime_ns == time, "it is not found again"


def test_a_run_that_knows_its_plant_has_another_address(tmp_path):
    plain, calibrated = (
        {run.seed: run.address for run in planned(camera_study(tmp_path)) if run.levels["case"] == case}
        for case in ("plain", "calibrated")
    )
    assert not {*plain.values()} & {*calibrated.values()}
    alone = planned(camera_study(tmp_path, cases=None, calibrate=None))
    assert [run.address for run in alone] == [*plain.values()]
    EXCITATION["trajectory"]["poses"] += 1
    try:
        assert not {run.address for run in planned(camera_study(tmp_path))} & {*calibrated.values()}
    finally:
        EXCITATION["trajectory"]["poses"] -= 1


@pytest.mark.slow
def test_an_excitation_that_is_stopped_is_a_row_with_its_reason(tmp_path, monkeypatch):
    stay_here(monkeypatch)
    monkeypatch.setitem(EXCITATION, "safety", {"position_error_mm": 1})
    done = swept(
        camera_study(tmp_path, seeds="1..1", cases=None, calibrate={"excitation": "./short_excitation.yaml"}),
        tmp_path,
    )
    (row,) = done.rows
    assert (row.status, done.exit_code) == ("aborted", 0)
    assert row.reason.startswith("no self-calibration: the excitation was stopped: ")


@pytest.mark.parametrize(
    ("calibrate", "settings", "said"),
    [
        ({"cases": ["other"]}, {}, "calibrate.cases.0: is no case; there are plain, calibrated"),
        ({}, {"estimator": {"kind": "exact"}}, "calibrate: the estimator of stay knows no calibration"),
        (
            {"excitation": "./stay.yaml"},
            {},
            "calibrate.excitation: ./stay.yaml is no excitation: its controller is ioc, not open_loop",
        ),
        (
            {"excitation": "realistic"},
            {},
            "calibrate.excitation: realistic is a study, not an experiment. Start it with: tcrctl sweep realistic",
        ),
    ],
)
def test_what_cannot_be_calibrated_is_refused_at_its_place(tmp_path, calibrate, settings, said):
    with pytest.raises(SpecError) as caught:
        planned(camera_study(tmp_path, set={**BIASED, **settings}, calibrate=calibrate))
    (problem,) = caught.value.problems
    assert said == f"{problem.key}: {problem.message}"


def test_a_misspelt_excitation_is_one_message(tmp_path, capsys):
    path = study_file(tmp_path, calibrate={"excitation": "excitaton"})
    assert main(["validate", str(path)]) == 2
    said = capsys.readouterr().err
    assert "quick.yaml:" in said
    assert "calibrate.excitation: there is no experiment named 'excitaton'" in said
