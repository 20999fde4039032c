"""The plant in tcrctl's loop: its runs are recorded and replayed, and the controller holds it."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import entry_points

import numpy as np
import pytest
from tcrctl_mujoco.plant import MujocoPlant, MujocoSection

import tcrctl
from tcrctl.errors import InputError
from tcrctl.extend import Command
from tcrctl.replay.replay import replay

installed = any(point.name == "mujoco" for point in entry_points(group="tcrctl.plants"))
#: The name that the package registers, or where its pair is if it is not installed.
KIND = "mujoco" if installed else "tcrctl_mujoco:MUJOCO"
PATH = {
    "name": "line",
    "robot": "tcr600",
    "trajectory": {
        "kind": "strokes",
        "strokes": [{"line": [[-10, 0], [10, 0]]}],
        "plane": {"offset_mm": [0, 0, 10]},
    },
    "controller": {"kind": "ioc"},
    "plant": {"kind": KIND, "noise_um": 50},
}


def test_drives_stop_at_their_stroke_and_what_was_sent_is_told(tcr700):
    plant = MujocoPlant(MujocoSection(), replace(tcr700, stroke=(-1e-3, 1e-3)), 0.05, 0)
    sent = plant.write(Command(np.full(6, 0.05), np.zeros(6)))
    np.testing.assert_allclose(sent.drive, 1e-3)
    np.testing.assert_allclose(sent.speed, 0.02)
    np.testing.assert_array_equal(plant.read().drive, sent.drive)


def test_a_simulation_that_becomes_unstable_is_an_error_and_does_not_begin_again(
    tcr700, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a file of warnings
    plant = MujocoPlant(MujocoSection(), tcr700, 0.05, 0)
    plant._drive = np.full(6, 0.2)  # no drive jumps so
    with pytest.raises(RuntimeError, match="unstable after 0 s"):
        plant.write(Command(np.zeros(6), np.zeros(6)))


def test_the_same_seed_gives_the_same_noise(tcr700):
    plants = [MujocoPlant(MujocoSection(noise_um=50), tcr700, 0.05, seed) for seed in (1, 1, 2)]
    one, same, other = (plant.read().nodes for plant in plants)
    np.testing.assert_array_equal(one, same)
    assert 1e-5 < np.std(one - other) < 1e-4


def test_a_step_that_makes_no_whole_period_is_refused():
    with pytest.raises(InputError, match="whole number of steps"):
        tcrctl.simulate({**PATH, "plant": {"kind": KIND, "step_ms": 0.3}})


@pytest.mark.skipif(not installed, reason="a log is replayed with installed packages: pip install .")
def test_the_shipped_controller_holds_it_and_the_log_replays(tmp_path):
    run = tcrctl.run(PATH, out=tmp_path)
    assert run.summary["status"] == "success"
    assert 1e3 * run.error.max() < 1.0
    assert replay(run.path).status == "identical"
