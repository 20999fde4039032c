"""The program from Python: the same runs as from the command line, and nothing loaded before it is used."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import tcrctl
from support.short_runs import SHORT
from tcrctl.errors import InputError
from tcrctl.replay.replay import replay

ROOT = Path(__file__).parents[2]
HOLD = {
    "name": "own",
    "robot": "tcr600",
    "trajectory": {"kind": "hold", "duration_s": 0.3},
    "controller": {"kind": "kinematic"},
    "plant": {"kind": "simulated", "noise_um": 50.0},
}


def test_importing_the_package_loads_nothing_that_is_heavy():
    heavy = {"numba", "numpy", "scipy", "pydantic", "mcap", "matplotlib", "yaml", "typer"}
    program = f"import sys, tcrctl; tcrctl.__version__; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_what_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'walk'"):
        tcrctl.walk  # noqa: B018
    assert {"run", "load", "simulate", "Run"} <= set(dir(tcrctl))


def test_the_types_that_are_told_are_those_that_are_there():
    stub = (ROOT / "tcrctl" / "__init__.pyi").read_text()
    assert (ROOT / "tcrctl" / "py.typed").is_file()
    for name, module in tcrctl._API.items():
        assert f"from {module} import {name} as {name}\n" in stub
        assert getattr(tcrctl, name).__module__ == module


@pytest.mark.slow
def test_a_run_tells_what_was_recorded_and_replays(tmp_path):
    run = tcrctl.run("letter_t", set=list(SHORT), out=tmp_path)
    assert run.summary["status"] == "success"
    assert run.spec["trajectory"]["kind"] == "strokes"
    assert run.columns("t")["t"].shape == run.error.shape
    assert run.reference.shape == (len(run.error), 3)
    assert 1e3 * run.error.max() == pytest.approx(run.summary["position_error_mm"]["max"], rel=1e-9)
    assert "start" in {event.kind for event in run.events}
    assert replay(run.path).status == "identical"
    for path in (run.path, run.path.parent, str(run.path)):
        np.testing.assert_array_equal(tcrctl.load(path).error, run.error)


@pytest.mark.slow
def test_a_run_from_a_map_is_that_of_the_file_with_the_same_keys(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(json.dumps(HOLD))
    runs = [
        tcrctl.run(spec, set={"trajectory.duration_s": 0.4}, seed=3, out=tmp_path / "runs")
        for spec in (HOLD, path)
    ]
    one, other = (run.columns("estimate_q")["estimate_q"] for run in runs)
    assert len(one) == 8
    assert one.tobytes() == other.tobytes()


@pytest.mark.slow
def test_a_simulation_is_reset_to_the_same_measurements_and_follows_speeds():
    simulation = tcrctl.simulate(HOLD)
    begins = [simulation.reset().nodes.copy() for _ in range(2)]
    np.testing.assert_array_equal(*begins)
    speed = np.array([0.01, 0.0, 0.0])
    before = simulation.truth.position
    for _ in range(20):
        measured = simulation.step(speed)
    assert simulation.time == pytest.approx(1.0)
    np.testing.assert_allclose(measured.drive, 1.0 * speed, atol=1e-12)
    assert np.linalg.norm(simulation.truth.position - before) > 5e-3


@pytest.mark.slow
def test_speeds_that_are_none_are_refused():
    simulation = tcrctl.simulate(HOLD)
    with pytest.raises(InputError, match="reset comes before"):
        simulation.step(np.zeros(3))
    simulation.reset()
    for speed in (np.zeros(2), np.full(3, np.nan)):
        with pytest.raises(InputError, match="3 finite numbers"):
            simulation.step(speed)


def test_settings_of_another_form_are_refused():
    with pytest.raises(InputError, match=r"map of dotted keys to values, or a list of 'a\.b=c'"):
        tcrctl.run("letter_t", set="controller.period_s=0.1")


def test_a_map_with_problems_lists_them_by_key():
    with pytest.raises(InputError, match=r"controller\.gain: unknown key"):
        tcrctl.simulate({**HOLD, "controller": {"kind": "kinematic", "gain": 1}})


@pytest.mark.slow
def test_a_table_for_pandas_has_one_column_per_number(tmp_path, monkeypatch):
    run = tcrctl.run(HOLD, out=tmp_path)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="needs pandas"):
        run.to_pandas()
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))
    table = run.to_pandas("t", "applied_speed")
    assert list(table) == ["t", "applied_speed_0", "applied_speed_1", "applied_speed_2"]
    assert {len(column) for column in table.values()} == {6}


@pytest.mark.slow
def test_a_process_that_sets_no_flags_writes_a_log_like_the_command_line(tmp_path):
    bare = {key: value for key, value in os.environ.items() if key != "NUMBA_OPT"}
    program = f"import json, tcrctl; tcrctl.run(json.loads({json.dumps(HOLD)!r}), out={str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=bare, check=True, capture_output=True)
    (log,) = tmp_path.glob("*_own_*/log.mcap")
    found = replay(log)
    assert (found.status, found.environment) == ("identical", ())
