"""Laws of comparing two logs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.diff import diff
from tcrctl.cli.app import main

N_STEPS = 30
SPEC = b"name: a\ncontroller: {period_s: 0.05, weights: {position: 3.0e4}}\n"
VERSIONS = {"numpy": "2.1.0", "python": "3.12.1"}


def write(path, *, spec=SPEC, versions=VERSIONS, change=lambda step: step, lost=(), **options):
    attachments = {
        "spec.resolved.yaml": ("application/yaml", spec),
        "robot.yaml": ("application/yaml", b"name: r\nmodules: {count: 3}\n"),
        "versions.json": ("application/json", json.dumps(versions).encode()),
    }
    with open_log(path, attachments=attachments, **options) as log:
        for k in range(N_STEPS):
            step = records.record(k)
            change(step)
            if k not in lost:
                log.step(step)
        log.finish(STOP)
    return path


@pytest.fixture
def a(tmp_path):
    return write(tmp_path / "a.mcap")


@pytest.mark.slow
def test_a_log_is_the_same_as_itself_and_as_another_of_the_same_bits(a, tmp_path, capsys):
    assert diff(a, a).same
    again = write(tmp_path / "b.mcap", versions={**VERSIONS, "numpy": "2.2.0"})
    found = diff(a, again)
    assert found.same
    assert [(entry.key, entry.a, entry.b) for entry in found.provenance] == [("numpy", "2.1.0", "2.2.0")]
    assert main(["diff", str(a), str(again)]) == 0
    assert "same: 30 steps in both" in capsys.readouterr().out


def test_settings_are_compared_one_by_one(a, tmp_path):
    spec = SPEC.replace(b"3.0e4", b"7.2e4").replace(b"0.05", b"0.05, horizon_s: 0.8")
    found = diff(a, write(tmp_path / "b.mcap", spec=spec))
    assert [(entry.key, entry.a, entry.b) for entry in found.settings] == [
        ("controller.weights.position", 3.0e4, 7.2e4),
        ("controller.horizon_s", None, 0.8),
    ]
    assert (found.first, found.same) == (None, False)


@pytest.mark.slow
def test_one_ulp_in_one_column_is_found_with_its_step_and_size(a, tmp_path, capsys):
    def nudge(step):
        if step.k in (12, 20):
            step.truth.position[1] = np.nextafter(step.truth.position[1], np.inf)

    b = write(tmp_path / "b.mcap", change=nudge)
    found = diff(a, b)
    (deviation,) = found.deviations
    assert (deviation.field, deviation.first_step, deviation.steps) == ("truth.position", 12, 2)
    assert 0.0 < deviation.largest < 1e-14
    assert main(["diff", str(a), str(b), "--json"]) == 3
    printed = json.loads(capsys.readouterr().out)
    assert printed["status"] == "different"
    assert printed["first_difference"]["field"] == "truth.position[1]"
    assert printed["first_difference"]["step"] == 12
    assert printed["first_difference"]["ulps"] == 1
    assert printed["first_difference"]["a"] < printed["first_difference"]["b"]


def test_steps_that_only_one_log_has_make_a_difference(a, tmp_path):
    found = diff(a, write(tmp_path / "b.mcap", lost={0, 7, 29}))
    assert (found.steps, found.first, found.same) == ((3, 0, 27), None, False)
    assert diff(write(tmp_path / "c.mcap", lost={0, 7, 29}), a).steps == (0, 3, 27)


def test_a_lean_log_agrees_with_a_full_one_of_the_same_run(tmp_path):
    def coarse(step):  # what a lean step rounds
        for name in ("position", "normal", "tension"):
            object.__setattr__(
                step.truth, name, getattr(step.truth, name).astype(np.float32).astype(np.float64)
            )

    full, lean = (
        write(tmp_path / f"{every}.mcap", change=coarse, full_state_s=every * records.PERIOD_S)
        for every in (1, 10)
    )
    assert diff(full, lean).same


def test_durations_are_not_compared(a, tmp_path):
    slower = write(tmp_path / "b.mcap", change=lambda step: object.__setattr__(step.timing, "control", 9.0))
    assert diff(a, slower).same


def test_what_is_no_log_exits_2(a, tmp_path, capsys):
    text = tmp_path / "notes.txt"
    text.write_text("not a log")
    assert main(["diff", str(a), str(text)]) == 2
    assert str(text) in capsys.readouterr().err
