"""The example of a learnt model: it learns from a log, holds its experiment, and its replay is identical."""

from __future__ import annotations

import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from tcrctl import load
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.replay.replay import replay

PLUGINS = Path(__file__).parents[2] / "examples" / "plugins"
NAMES = runpy.run_path(str(PLUGINS / "learnt.py"))
powers, slopes, learn, UNIT = (NAMES[name] for name in ("powers", "slopes", "learn", "UNIT"))


def ran(spec, out, *settings):
    return run_experiment(prepare(load_spec(str(spec), settings)), out=out)


def test_the_monomials_are_all_up_to_the_third_degree_and_their_slopes_are_derivatives():
    found, drive, step = powers(3), np.array([0.3, -0.7, 0.0]), 1e-6
    assert len(found) == len({tuple(row) for row in found}) == 20
    assert found.sum(axis=1).max() == 3
    for i, way in enumerate(step * np.eye(3)):
        change = np.prod((drive + way) ** found, axis=1) - np.prod((drive - way) ** found, axis=1)
        assert slopes(drive, found)[:, i] == pytest.approx(change / (2 * step), abs=1e-8)


def test_a_cubic_map_is_learnt_through_noise():
    random = np.random.default_rng(0)
    drive, wanted = UNIT * random.uniform(-1, 1, (1000, 3)), random.normal(size=(20, 3))
    position = np.prod((drive / UNIT)[:, None, :] ** powers(3), axis=2) @ wanted
    weights, missed = learn(drive, position + 1e-3 * random.normal(size=position.shape))
    assert weights == pytest.approx(wanted, abs=1e-3)
    assert missed == pytest.approx(
        np.sqrt(3) * 1e-3, rel=0.2
    )  # what is held out is not learnt: its noise stays


def test_weights_of_another_robot_are_refused():
    settings = load_spec(str(PLUGINS / "learnt.yaml")).spec.controller
    with pytest.raises(ValueError, match="35 weights are needed for 4 cables"):
        NAMES["Learnt"](settings, type("", (), {"n_cables": 4})())


@pytest.mark.slow
def test_what_is_learnt_from_a_log_is_truer_than_a_map_at_rest_is_run_recorded_and_replayed(
    tmp_path, monkeypatch, capsys, tcr600
):
    folder = tmp_path / "plugins"
    shutil.copytree(PLUGINS, folder, ignore=shutil.ignore_patterns("learnt.yaml", "__pycache__"))
    babbled = ran(
        folder / "babble.yaml", tmp_path / "runs", "trajectory.duration_s=16", "trajectory.fastest_s=4"
    )
    monkeypatch.setattr(sys, "argv", ["learnt.py", str(babbled.log)])
    runpy.run_path(str(folder / "learnt.py"), run_name="__main__")
    said = capsys.readouterr().out
    held_out_mm = float(said.split()[-2])
    assert said.startswith("learnt.yaml: 20 weights, held out rms")
    columns = load(babbled.log).columns("estimate_drive", "estimate_position")
    at_rest = tcr600.rest_position + columns["estimate_drive"] @ tcr600.rest_gain[:3].T
    assert 3 * held_out_mm < 1e3 * np.linalg.norm(at_rest - columns["estimate_position"], axis=1).mean()
    small = ("trajectory.duration_s=8", "trajectory.width_mm=6", "trajectory.raise_mm=3")
    learnt = ran(folder / "learnt.yaml", tmp_path / "runs", *small)
    assert learnt.status == "success"
    found = replay(learnt.log, plugins=folder)
    assert (found.status, found.steps, found.environment) == ("identical", 160, ())
