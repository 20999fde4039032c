"""A run from file to folder: the log, the summary, and every way in which it can end."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from support.log_files import doctor
from support.short_runs import ROOT, SHORT, arguments, short_spec, start
from tcrctl.analysis.info import inspect
from tcrctl.cli.app import main
from tcrctl.cli.run_table import rows
from tcrctl.controller.shell import Shell
from tcrctl.errors import ArmingRefusedError, DeviceError, DivergenceError, InputError, LogError
from tcrctl.experiment.criterion import parse_criterion
from tcrctl.experiment.first_look import START_READS
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.run_folder import make_run_folder
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover
from tcrctl.log.writer import LogWriter
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.replay.replay import replay


@pytest.fixture(scope="module")
def short():
    return prepare(short_spec())


@pytest.fixture(scope="module")
def finished(short, tmp_path_factory):
    """Summary and log of one short run."""
    summary = run_experiment(short, out=tmp_path_factory.mktemp("runs"))
    return summary, read_log(summary.log)


def commands(log):
    return b"".join(s.wanted.speed.tobytes() + s.applied.drive.tobytes() for s in log.steps())


@pytest.mark.slow
def test_every_step_is_in_the_log_once_and_in_order(short, finished):
    summary, log = finished
    steps = list(log.steps())
    assert log.complete
    assert [s.k for s in steps] == list(range(short.steps))
    assert summary.measures.steps == short.steps == inspect(summary.log).steps
    assert (summary.status, summary.exit_code, summary.reason) == ("success", 0, "")
    np.testing.assert_allclose([s.t for s in steps], short.period * np.arange(short.steps))


def test_the_summary_agrees_with_the_log(finished):
    summary, log = finished
    steps = list(log.steps())
    error = [np.linalg.norm(s.truth.position - s.reference.position) for s in steps]
    assert summary.measures.position_error_mm["max"] == pytest.approx(1e3 * max(error))
    assert 0.0 < summary.measures.position_error_mm["max"] < 3.0
    assert summary.measures.tension_n["min"] == min(s.truth.tension.min() for s in steps)
    control = [s.timing.estimate + s.timing.control for s in steps]
    assert summary.measures.control_ms["p50"] == pytest.approx(1e3 * np.median(control))
    assert summary.as_json() == json.loads(log.stop["summary"])
    assert log.stop["status"] == "success"
    assert json.loads((summary.log.parent / "summary.json").read_text()) == summary.as_json()


class OnceLooked(SimulatedPlant):
    """A bench whose drives are not switched on; says how often it was measured before."""

    reads = 0

    def read(self):
        OnceLooked.reads += 1
        return super().read()

    def start(self):
        raise ArmingRefusedError(["enough is seen"])


def test_a_robot_is_looked_at_once_before_it_is_armed(short, tmp_path, monkeypatch):
    bench = prepare(short_spec("plant={kind: rig, rig: loopback}"))
    plant = OnceLooked(short.spec.plant, bench.robot, bench.period, 1)
    monkeypatch.setattr("tcrctl.experiment.run.build_plant", lambda experiment, operation: (plant, None))
    summary = run_experiment(bench, out=tmp_path)
    assert (summary.exit_code, "enough is seen" in summary.reason) == (4, True)
    assert OnceLooked.reads == START_READS


def test_the_folder_holds_the_run_and_everything_to_repeat_it(short, finished):
    summary, log = finished
    folder = summary.log.parent
    assert folder.name == summary.run_id == log.start["run_id"]
    assert {p.name for p in folder.iterdir()} == {
        "log.mcap",
        "spec.yaml",
        "spec.resolved.yaml",
        "robot.yaml",
        "summary.json",
    }
    given = short.loaded.path.read_bytes()
    assert (folder / "spec.yaml").read_bytes() == given == log.attachments["spec.yaml"][1]
    resolved = (folder / "spec.resolved.yaml").read_bytes()
    assert resolved == log.attachments["spec.resolved.yaml"][1]
    assert log.attachments["robot.yaml"][1] == short.loaded.robot_path.read_bytes()
    assert {"tcrctl", "numpy", "numba", "python"} <= set(json.loads(log.attachments["versions.json"][1]))
    assert json.loads(log.start["overrides"]) == list(SHORT)


def test_the_resolved_file_describes_the_same_experiment(short, finished, tmp_path):
    path = tmp_path / "again.yaml"
    path.write_bytes((finished[0].log.parent / "spec.resolved.yaml").read_bytes())
    assert load_spec(str(path)).spec == short.spec


def test_the_reference_begins_where_the_plant_is(short, finished):
    _, log = finished
    first = next(log.steps())
    offset = first.truth.position - short.robot.rest_position
    assert np.linalg.norm(offset) > 5e-4  # a mismatched plant hangs elsewhere
    np.testing.assert_allclose(first.reference.position, first.truth.position, atol=5e-5)


@pytest.mark.slow
def test_without_a_sight_of_the_tip_ring_the_reference_is_the_trajectory(tmp_path):
    experiment = prepare(short_spec("plant.measured_rings=[3, 6, 9]"))
    summary = run_experiment(experiment, out=tmp_path)
    log = read_log(summary.log)
    first = next(log.steps())
    np.testing.assert_array_equal(first.reference.position, experiment.trajectory.position(np.zeros(1))[0])
    assert [event.level for event in log.events() if event.kind == "start"] == ["warning"]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_commands_another_seed_does_not(short, finished, tmp_path):
    again = read_log(run_experiment(prepare(short.loaded), out=tmp_path).log)
    assert commands(again) == commands(finished[1])
    other = read_log(run_experiment(prepare(short.loaded, seed=7), out=tmp_path).log)
    assert commands(other) != commands(finished[1])
    assert b"seed: 7\n" in other.attachments["spec.resolved.yaml"][1]
    assert other.start["seed"] == "7"


@pytest.mark.slow
def test_no_kernel_is_compiled_or_loaded_during_a_run(tmp_path):
    program = (
        "import sys; sys.path[:0] = sys.argv[1:3]\n"
        "from pathlib import Path\n"
        "from support.short_runs import short_spec\n"
        "from support.kernels import loaded_kernels\n"
        "from tcrctl.experiment.prepare import prepare, plan\n"
        "from tcrctl.experiment.run import run_experiment\n"
        "made = prepare(short_spec())\n"
        "before = loaded_kernels()\n"
        "run_experiment(made, out=Path(sys.argv[3]))\n"
        "after = loaded_kernels()\n"
        "assert len(before) > 20\n"
        "sys.exit(str({k: n for k, n in after.items() if before[k] != n}) if before != after else 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(ROOT), str(ROOT / "tests"), str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def failing_plant(monkeypatch, error, *, write_at=None, close=False):
    """Let simulated plants fail in a step or when closed; returns how often they were closed."""
    closed = []
    write = SimulatedPlant.write

    def failing_write(self, command):
        if self.time > write_at - 1e-9:
            raise error
        return write(self, command)

    def closing(self):
        closed.append(self)
        if close:
            raise error

    if write_at is not None:
        monkeypatch.setattr(SimulatedPlant, "write", failing_write)
    monkeypatch.setattr(SimulatedPlant, "close", closing)
    return closed


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (DeviceError("drive 2 does not answer"), "error", 5),
        (DivergenceError(0.5, 1.0, 1e-5), "aborted", 4),
    ],
)
def test_a_plant_that_fails_leaves_a_finished_log_and_is_closed(
    short, tmp_path, monkeypatch, error, status, code
):
    closed = failing_plant(monkeypatch, error, write_at=0.5)
    summary = run_experiment(short, out=tmp_path)
    log = read_log(summary.log)
    assert (summary.status, summary.exit_code, summary.reason) == (status, code, str(error))
    assert len(closed) == 1
    assert log.complete
    assert (log.stop["status"], log.stop["reason"]) == (status, str(error))
    assert [s.k for s in log.steps()] == list(range(10))
    assert any(event.level == "error" and event.message == str(error) for event in log.events())
    assert summary.measures.steps == 10
    assert json.loads((summary.log.parent / "summary.json").read_text())["status"] == status


@pytest.mark.slow
def test_a_plant_that_cannot_be_closed_is_an_error_even_after_the_last_step(short, tmp_path, monkeypatch):
    failing_plant(monkeypatch, DeviceError("brake stuck"), close=True)
    summary = run_experiment(short, out=tmp_path)
    assert (summary.status, summary.reason, summary.measures.steps) == ("error", "brake stuck", short.steps)


def test_a_fault_of_the_program_leaves_a_finished_log_and_a_closed_plant(short, tmp_path, monkeypatch):
    closed = failing_plant(monkeypatch, ZeroDivisionError("a bug"), write_at=0.3)
    with pytest.raises(ZeroDivisionError):
        run_experiment(short, out=tmp_path)
    (path,) = tmp_path.glob("*/log.mcap")
    log = read_log(path)
    assert len(closed) == 1
    assert log.complete
    assert log.stop["status"] == "error"
    assert "a bug" in log.stop["reason"]


@pytest.mark.slow
def test_a_controller_that_raises_leaves_a_finished_log_and_a_closed_plant(short, tmp_path, monkeypatch):
    closed = failing_plant(monkeypatch, DeviceError("unused"))
    control = Shell.control

    def failing_control(self, estimate, reference):
        if reference.t > 0.38:
            raise FloatingPointError("a bug of the controller")
        return control(self, estimate, reference)

    monkeypatch.setattr(Shell, "control", failing_control)
    with pytest.raises(FloatingPointError):
        run_experiment(short, out=tmp_path)
    (path,) = tmp_path.glob("*/log.mcap")
    log = read_log(path)
    assert (log.complete, log.stop["status"], len(closed)) == (True, "error", 1)
    assert "a bug of the controller" in log.stop["reason"]
    assert [step.k for step in log.steps()] == list(range(8))
    assert doctor(path).returncode == 0
    assert not recover(path, tmp_path / "copy.mcap").lossy


def test_a_second_ctrl_c_leaves_a_finished_log_and_a_closed_plant(short, tmp_path, monkeypatch):
    closed = failing_plant(monkeypatch, DeviceError("unused"))

    def press_twice(done, total):
        if done == 8:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run_experiment(short, out=tmp_path, progress=press_twice)
    (path,) = tmp_path.glob("*/log.mcap")
    log = read_log(path)
    assert (log.complete, log.stop["status"], len(closed)) == (True, "aborted", 1)
    assert len(list(log.steps())) == 8


@pytest.mark.slow
def test_what_fitted_at_the_start_and_does_not_later_is_a_device(tmp_path, monkeypatch, capsys):
    failing_plant(monkeypatch, InputError("the PLC says it is another one"), write_at=0.3)
    assert main(["run", "letter_t", "--json", "--out", str(tmp_path), *arguments()]) == 5
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line)["reason"] == "the PLC says it is another one"


@pytest.mark.slow
def test_nobody_who_is_told_about_a_run_can_end_it(short, tmp_path):
    def gone(*message):
        raise BrokenPipeError(32, "Broken pipe")

    summary = run_experiment(short, out=tmp_path, notify=gone, progress=gone)
    assert (summary.status, summary.exit_code) == ("success", 0)
    assert read_log(summary.log).complete


def test_a_disk_that_fills_up_is_an_error_and_the_plant_is_closed(short, tmp_path, monkeypatch):
    closed = failing_plant(monkeypatch, DeviceError("unused"))
    step = LogWriter.step

    def full(self, record):
        if record.k == 12:
            raise LogError(self.path, "writing failed: No space left on device")
        step(self, record)

    monkeypatch.setattr(LogWriter, "step", full)
    summary = run_experiment(short, out=tmp_path)
    assert (summary.status, summary.exit_code, summary.measures.steps) == ("error", 5, 12)
    assert "No space left" in summary.reason
    assert len(closed) == 1


@pytest.mark.slow
def test_a_run_on_a_file_system_that_is_full_says_so_in_its_log(tiny_filesystem, tmp_path, capsys):
    options = ["--json", "--out", str(tiny_filesystem), *arguments("trajectory.settle_s=5")]
    assert main(["run", "letter_t", *options, "--set", "log.flush_steps=20"]) == 5
    result = json.loads(capsys.readouterr().out)
    log = read_log(result["log"])
    steps = [step.k for step in log.steps()]
    assert result["status"] == log.stop["status"] == "error"
    assert "No space left on device" in result["reason"]
    assert "No space left on device" in log.stop["reason"]
    assert steps == list(range(len(steps)))
    assert 0 <= result["steps"] - len(steps) <= 20
    mended = recover(log.path, tmp_path / "mended.mcap")
    assert (mended.steps, mended.lossy) == (len(steps), True)
    assert doctor(mended.path).returncode == 0
    found = replay(log.path)
    assert (found.status, found.compared) == ("incomplete", len(steps))


def test_a_run_beyond_the_safety_limit_is_aborted_with_exit_code_4(short, tmp_path):
    safety = short.spec.safety.model_copy(update={"position_error_mm": 1e-3})
    tight = replace(short, spec=short.spec.model_copy(update={"safety": safety}))
    summary = run_experiment(tight, out=tmp_path)
    assert (summary.status, summary.exit_code) == ("aborted", 4)
    assert "position error" in summary.reason
    last = list(read_log(summary.log).steps())[-1]
    assert not last.applied.speed.any()
    assert last.k + 1 == summary.measures.steps


def test_a_stopped_run_has_passed_no_criterion_and_its_table_says_why(short, tmp_path):
    """Not those either that were met so far: nobody knows what would have come."""
    safety = short.spec.safety.model_copy(update={"position_error_mm": 1e-3})
    asked = tuple(map(parse_criterion, ("position_error_mm.max <= 1000", "overruns <= 0")))
    spec = short.spec.model_copy(update={"safety": safety, "criteria": asked})
    summary = run_experiment(replace(short, spec=spec), out=tmp_path)
    assert summary.status == "aborted"
    assert [verdict.passed for verdict in summary.criteria] == [False, False]
    shown = [(text, style) for name, text, style in rows(summary) if name == "criterion"]
    assert [style for _, style in shown] == ["yellow", "yellow"]
    assert all("the run was stopped" in text and "passed" not in text for text, _ in shown)
    times = [event.t for event in read_log(summary.log).events()]
    assert times == sorted(times)


@pytest.mark.slow
def test_run_prints_one_object_and_fails_a_criterion_with_exit_code_3(tmp_path, capsys):
    options = ["--json", "--out", str(tmp_path), *arguments("criteria=[position_error_mm.max <= 0.001]")]
    assert main(["run", "letter_t", *options]) == 3
    printed = capsys.readouterr()
    result = json.loads(printed.out)
    assert result["status"] == "failed"
    assert result["criteria"][0]["passed"] is False
    assert Path(result["log"]).is_file()
    assert "position_error_mm.max is" in printed.err


@pytest.mark.slow
def test_run_prints_a_table_and_where_the_log_is(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "letter_t", *arguments()]) == 0
    printed = capsys.readouterr()
    (log,) = (tmp_path / "logs").glob("*_letter_t_*/log.mcap")
    assert f"tcrctl info {log.relative_to(tmp_path)}" in printed.out.splitlines()[-1]
    assert "position error" in printed.out
    assert "passed: position_error_mm.max" in printed.out
    assert printed.err.startswith("letter_t: robot tcr600")
    assert "\x1b" not in printed.out + printed.err


BAD_INPUT = {
    "unknown experiment": (["letter_q"], 2, "letter_q"),
    "missing file": (["./nowhere.yaml"], 2, "nowhere.yaml"),
    "unknown key": (["letter_t", "--set", "controler.period_s=1"], 2, "controler"),
    "wrong type": (["letter_t", "--set", "controller.period_s=fast"], 2, "period_s"),
    "unknown plant": (["letter_t", "--set", "plant.kind=rig"], 2, "rig"),
    "unknown result": (["letter_t", "--set", "criteria=[errors.max <= 1]"], 2, "errors.max"),
    "negative seed": (["letter_t", "--seed", "-1"], 2, "--seed"),
    "infeasible": (["letter_t", "--set", "trajectory.plane.offset_mm=[0, 0, -60]"], 2, "infeasible at t ="),
    "no orientation": (
        ["letter_t", "--set", "controller.output=pose", "--set", "controller.weights.normal=30"],
        2,
        "orientation",
    ),
    "folder is a file": (["letter_t", "--out", "{file}"], 5, "is a file"),
    "folder below a file": (["letter_t", "--out", "{file}/runs"], 5, "is a file"),
    "no permission": (["letter_t", "--out", "/proc/runs"], 5, "/proc/runs"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BAD_INPUT)
@pytest.mark.parametrize("as_json", [False, True])
def test_bad_input_is_one_message_and_leaves_nothing(name, as_json, tmp_path, monkeypatch, capsys):
    given, code, part = BAD_INPUT[name]
    file = tmp_path / "a_file"
    file.write_text("mine")
    monkeypatch.chdir(tmp_path)
    options = [argument.format(file=file) for argument in given]
    assert main(["run", *options, *(["--json"] if as_json else [])]) == code
    printed = capsys.readouterr()
    assert "Traceback" not in printed.err
    assert part in printed.err.replace("\n", " ")
    if as_json:
        result = json.loads(printed.out)
        assert result["status"] == "error"
        assert part in result["reason"]
    else:
        assert printed.out == ""
        assert printed.err.count("error: ") + printed.err.count("Error") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]


@pytest.mark.slow
def test_an_infeasible_trajectory_runs_if_forced(tmp_path, capsys):
    overrides = arguments("controller.speed_limit_mm_s=3")
    assert main(["run", "letter_t", "--out", str(tmp_path), *overrides]) == 2
    assert "--force" in capsys.readouterr().err
    code = main(["run", "letter_t", "--out", str(tmp_path), "--force", "--json", *overrides])
    printed = capsys.readouterr()
    assert code in (0, 3, 4)
    assert "warning" in printed.err
    assert json.loads(printed.out)["saturated_fraction"] > 0.0


def test_a_log_that_cannot_be_opened_leaves_no_folder(short, tmp_path, monkeypatch):
    def refuse(self, *arguments, **options):
        raise LogError("log.mcap", "cannot be created: disk quota exceeded")

    closed = failing_plant(monkeypatch, DeviceError("unused"))
    monkeypatch.setattr(LogWriter, "__init__", refuse)
    with pytest.raises(LogError, match="quota"):
        run_experiment(short, out=tmp_path / "a" / "b")
    assert list(tmp_path.iterdir()) == []
    assert len(closed) == 1


def test_runs_of_the_same_second_get_folders_of_their_own(tmp_path):
    folders = [make_run_folder(tmp_path, "same") for _ in range(20)]
    assert len({folder.run_id for folder in folders}) == 20
    folders[0].write("spec.yaml", b"once")
    with pytest.raises(DeviceError, match="exists"):
        folders[0].write("spec.yaml", b"twice")


# Runs that are ended from outside, all started at once: they mostly wait for the clock.


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Runs in processes of their own, paced by the clock, and their folders."""
    folders = {name: tmp_path_factory.mktemp(name) for name in ("int", "term", "kill", "json")}
    processes = {}
    for name, folder in folders.items():
        long = ["--set", "trajectory.settle_s=90"]  # so that none is over before its signal on a busy machine
        options = ["--realtime", *long, "--out", str(folder), *(["--json"] if name == "json" else [])]
        processes[name] = start(*options, cwd=folder)
    yield {name: (processes[name], folders[name]) for name in folders}
    for process in processes.values():
        process.kill()
        process.communicate()


def once_running(folder, steps=30):
    """Log of a run, as soon as it has so many steps on disk."""
    end = time.monotonic() + 240.0  # the kernels may have to be compiled
    while time.monotonic() < end:
        for path in folder.glob("*/log.mcap"):
            with suppress(InputError):  # nothing has reached the disk yet
                if sum(1 for _ in read_log(path).steps()) >= steps:
                    return path
        time.sleep(0.1)
    raise TimeoutError(f"no run in {folder}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "number", "code"),
    [("int", signal.SIGINT, 130), ("term", signal.SIGTERM, 143), ("json", signal.SIGTERM, 143)],
)
def test_a_signal_ends_a_run_with_a_complete_log(running, name, number, code):
    process, folder = running[name]
    path = once_running(folder)
    process.send_signal(number)
    out, err = process.communicate(timeout=20)
    log = read_log(path)
    steps = [s.k for s in log.steps()]
    assert process.returncode == code, err
    assert log.complete
    assert log.stop["status"] == "aborted"
    assert signal.Signals(number).name in log.stop["reason"]
    assert steps == list(range(len(steps)))
    assert len(steps) < 2300
    assert "Traceback" not in err
    result = json.loads((path.parent / "summary.json").read_text())
    assert (result["status"], result["steps"]) == ("aborted", len(steps))
    assert doctor(path).returncode == 0
    if name == "json":
        assert json.loads(out) == result
    else:
        assert "aborted" in out


@pytest.mark.slow
def test_a_killed_run_keeps_all_steps_but_those_of_the_last_flush_interval(running):
    process, folder = running["kill"]
    path = once_running(folder)
    process.kill()
    killed = time.time()
    process.communicate(timeout=20)
    log = read_log(path)
    steps = [s.k for s in log.steps()]
    late = log.columns(["timing_lateness"])["timing_lateness"]
    elapsed = (
        killed - int(log.start["epoch_ns"]) * 1e-9 - late[late > 0.05].sum()
    )  # missed steps are not made up for
    assert not log.complete
    assert steps == list(range(len(steps)))
    flushed = elapsed - 0.5 - 0.5  # flush interval, and one more: on a busy machine a flush is late, too
    assert len(steps) >= flushed / 0.05
    mended = recover(path, path.with_name("mended.mcap"))
    assert (mended.steps, mended.lossy) == (len(steps), True)
    assert doctor(mended.path).returncode == 0
    assert replay(mended.path).status == "identical"


@pytest.mark.slow
def test_paced_steps_begin_a_period_apart(running):
    log = read_log(once_running(running["term"][1]))
    columns = log.columns(["timing_lateness"])
    assert np.median(columns["timing_lateness"]) < 0.01
    assert columns["timing_lateness"].min() >= 0.0


@pytest.mark.slow
def test_a_run_that_begins_far_from_its_trajectory_is_longer_by_the_way_there_says_so_and_replays(tmp_path):
    far = prepare(short_spec("start.blend_s=0.1", "start.approach_mm_s=5"))
    summary = run_experiment(far, out=tmp_path)
    log = read_log(summary.log)
    starts = [event for event in log.events() if event.kind == "start"]
    assert summary.measures.steps > far.steps
    assert [event.level for event in starts] == ["warning"]
    assert "first goes there" in starts[0].message
    assert replay(summary.log).status == "identical"
