"""From the command line to the emulated devices and back: runs, signals, a killed program, work on the rig."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from support.loopback import patient_rig
from support.short_runs import ROOT, SHORT, arguments
from tcrctl.cli.app import main
from tcrctl.config import strict_yaml
from tcrctl.controller.shell import Shell
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log

pytestmark = pytest.mark.slow

#: A test computer is busy; the figure of a real bench is tried in the fault matrix.
WATCHDOG_MS = 1500


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Rig file of an emulated bench that runs in a process of its own."""
    path = tmp_path_factory.mktemp("bench") / "rig.yaml"
    path.write_text(patient_rig())
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "tcrctl.cli.app",
            "emulate",
            str(path),
            "--watchdog-ms",
            str(WATCHDOG_MS),
            "--json",
        ],
        env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    said = ""
    while "is emulated" not in said:
        line = process.stderr.readline()
        assert line, said
        said += line
    yield path
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=30)
    assert process.returncode == 0
    assert json.loads(out)["cameras"]["frames"] > 100


def on(rig):
    return (*SHORT, "plant.kind=rig", f"plant.rig={rig}")


@pytest.fixture(scope="module")
def experiment(rig):
    return prepare(load_spec("letter_t", on(rig)))


def answer(capsys, *given):
    """Exit code and object of a verb with --json."""
    code = main([*given, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_a_run_on_the_bench_follows_its_path_keeps_the_raw_markers_and_replays(experiment, tmp_path, capsys):
    summary = run_experiment(experiment, out=tmp_path, confirmed=True)
    log = read_log(summary.log)
    steps = list(log.steps())
    assert (summary.status, summary.reason) == ("success", "")
    assert summary.measures.position_error_mm["max"] < 3.0
    assert 0.0 < summary.measures.latency_ms["p50"] < summary.measures.latency_ms["max"]
    assert all(step.truth is None for step in steps)
    frames = [step.measurement.raw for step in steps if step.measurement.raw is not None]
    assert len(frames) > 0.8 * len(steps)
    assert {frame.positions.shape for frame in frames} == {(3 * (12 + 14), 3)}
    assert np.all(np.diff([frame.number for frame in frames]) > 0)
    age = [step.t - step.measurement.t for step in steps]
    assert np.median(age) < 0.05
    assert log.attachments["rig.yaml"][1] == experiment.loaded.rig.given
    changes = [event.message.partition(":")[0] for event in log.events() if event.kind == "supervisor"]
    assert changes[:2] == ["disarmed -> armed", "armed -> running"]
    assert changes[-2:] == ["running -> stopping", "stopping -> disarmed"]
    code, replayed = answer(capsys, "replay", str(summary.log))
    assert (code, replayed["status"], replayed["compared"]) == (0, "identical", len(steps))


def test_a_signal_stops_the_drives_before_the_program_ends(experiment, tmp_path):
    def terminate(done, total):
        if done == 10:
            signal.raise_signal(signal.SIGTERM)

    summary = run_experiment(experiment, out=tmp_path, confirmed=True, progress=terminate)
    assert (summary.status, summary.exit_code) == ("aborted", 143)
    events = [event.message for event in read_log(summary.log).events() if event.kind == "supervisor"]
    assert events[-1].startswith("stopping -> disarmed: standstill")


def test_a_fault_of_the_program_stops_the_drives_too(experiment, tmp_path, monkeypatch):
    control = Shell.control

    def broken(controller, estimate, reference):
        if estimate.t > 0.5:
            raise ZeroDivisionError("a bug")
        return control(controller, estimate, reference)

    monkeypatch.setattr(Shell, "control", broken)
    with pytest.raises(ZeroDivisionError):
        run_experiment(experiment, out=tmp_path, confirmed=True)
    (path,) = tmp_path.glob("*/log.mcap")
    events = [event.message for event in read_log(path).events() if event.kind == "supervisor"]
    assert events[-1].startswith("stopping -> disarmed: standstill")


def test_without_consent_the_run_has_a_log_and_no_motion(experiment, tmp_path, capsys, rig):
    summary = run_experiment(experiment, out=tmp_path)
    assert (summary.status, summary.exit_code, summary.measures.steps) == ("aborted", 4, 0)
    assert "--yes" in summary.reason
    options = arguments("plant.kind=rig", f"plant.rig={rig}")
    assert main(["run", "letter_t", *options, "--out", str(tmp_path / "none")]) == 2
    assert "no terminal to ask on" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_the_watchdog_holds_the_drives_of_a_killed_run_until_it_is_reset(rig, tmp_path, capsys):
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "tcrctl.cli.app", "run", "letter_t", "--yes", "--out", str(tmp_path)),
            *arguments("plant.kind=rig", f"plant.rig={rig}"),
        ],
        env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"},
        stdin=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    end = time.monotonic() + 240.0
    while not _enabled(rig, capsys) and time.monotonic() < end:
        time.sleep(0.1)
    process.kill()
    process.wait()
    time.sleep(2e-3 * WATCHDOG_MS)
    code, found = answer(capsys, "rig", "status", str(rig), "--robot", "tcr600")
    drives = found["robots"][0]["drives"]
    assert (code, drives["watchdog"], drives["enabled"]) == (0, True, False)
    assert answer(capsys, "rig", "check", str(rig), "--robot", "tcr600")[0] == 4
    code, refused = answer(capsys, "rig", "jog", str(rig), "--robot", "tcr600", *_jog("c1", 1), "--yes")
    assert (code, "watchdog" in refused["reason"]) == (4, True)
    assert answer(capsys, "rig", "reset", str(rig), "--robot", "tcr600", "--yes")[1]["cleared"] is True
    _, found = answer(capsys, "rig", "check", str(rig), "--robot", "tcr600")
    fine = {finding["what"] for finding in found["findings"] if finding["ok"]}
    assert {"cameras", "rings", "calibration", "PLC", "limits", "period", "fault", "zeroed"} <= fine, found


def _enabled(rig, capsys):
    _, found = answer(capsys, "rig", "status", str(rig), "--robot", "tcr600")
    return found["robots"][0]["drives"]["enabled"]


def _jog(cable, by_mm):
    return ["--cable", cable, "--by-mm", str(by_mm), "--speed-mm-s", "20"]


def test_jog_moves_one_cable_as_far_as_it_was_told(rig, capsys):
    given = ["rig", "jog", str(rig), "--robot", "tcr700", *_jog("c4", 2.5)]
    code, planned = answer(capsys, *given, "--dry-run")
    assert (code, planned["to_mm"]["c4"]) == (0, pytest.approx(planned["from_mm"]["c4"] + 2.5))
    assert main(given) == 2  # nobody can be asked
    capsys.readouterr()
    code, moved = answer(capsys, *given, "--yes")
    assert code == 0
    for cable in ("c1", "c2", "c3", "c4", "c5", "c6"):
        assert moved["to_mm"][cable] == pytest.approx(planned["to_mm"][cable], abs=0.1), cable
    back = [
        "rig",
        "jog",
        str(rig),
        "--robot",
        "tcr700",
        "--cable",
        "all",
        "--to-mm",
        "0",
        "--speed-mm-s",
        "20",
    ]
    code, home = answer(capsys, *back, "--yes")
    assert (code, max(map(abs, home["to_mm"].values())) < 0.1) == (0, True)
    assert answer(capsys, *given[:5], *_jog("c4", 95), "--yes")[0] == 2
    assert answer(capsys, *given[:5], *_jog("c9", 1), "--yes")[0] == 2


def test_zero_makes_the_present_positions_zero(rig, capsys):
    assert answer(capsys, "rig", "jog", str(rig), "--robot", "tcr700", *_jog("c1", 1), "--yes")[0] == 0
    given = ["rig", "zero", str(rig), "--robot", "tcr700"]
    code, looked = answer(capsys, *given, "--dry-run")
    assert (code, looked["before_mm"]["c1"]) == (0, pytest.approx(1.0, abs=0.1))
    code, done = answer(capsys, *given, "--yes")
    assert (code, done["zeroed"]) == (0, True)
    assert done["after_mm"]["c1"] == pytest.approx(0.0, abs=0.1)


def test_calibration_finds_where_the_cameras_are_and_keeps_the_file_as_it_is(rig, capsys, tmp_path):
    given = ["rig", "calibrate", str(rig), "--robot", "tcr600", "--seconds", "0.5"]
    data = strict_yaml.load(rig).data["robots"]["tcr600"]["calibration"]
    code, found = answer(capsys, *given, "--dry-run")
    assert (code, found["file"]) == (0, None)
    np.testing.assert_allclose(found["calibration"]["translation_m"], data["translation_m"], atol=2e-4)
    out = tmp_path / "calibrated.yaml"
    assert answer(capsys, *given, "-o", str(out))[0] == 0
    before, after = rig.read_text().splitlines(), out.read_text().splitlines()
    changed = [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert len(changed) == 1
    assert "calibration: {quaternion_xyzw" in after[changed[0]]
    assert main(["rig", "calibrate", "loopback", "--robot", "tcr600"]) == 2
    assert "is shipped" in capsys.readouterr().err


def test_a_rig_that_does_not_answer_is_exit_code_5(tmp_path, capsys):
    path = tmp_path / "nobody.yaml"
    path.write_text(patient_rig())
    code, found = answer(capsys, "rig", "check", str(path), "--robot", "tcr600")
    silent = {finding["what"]: finding["text"] for finding in found["findings"] if not finding["ok"]}
    assert (code, set(silent)) == (5, {"cameras", "PLC"})
    assert all("start it in another terminal: tcrctl emulate" in text for text in silent.values())
    code, found = answer(capsys, "rig", "status", str(path), "--robot", "tcr600")
    assert (code, "tcrctl emulate" in found["robots"][0]["trouble"]) == (5, True)
    assert answer(capsys, "rig", "check", str(path), "--dry-run")[0] == 0
