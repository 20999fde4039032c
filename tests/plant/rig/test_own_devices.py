"""Cameras and drives from elsewhere: with the members of the protocols they work; broken ones end safely."""

from __future__ import annotations

import json
import pickle
import shutil
from textwrap import dedent

import numpy as np
import pytest

from support.own_devices import DEVICES, write_bench
from tcrctl.cli.app import main
from tcrctl.commissioning.check import check_rig
from tcrctl.errors import ArmingRefusedError, DeviceError, InputError, SpecError, UntrustworthyDeviceError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.plant.rig.assembly import build_rig, connect_cameras, connect_drives
from tcrctl.plant.rig.devices import Cameras, DriveControl, Drives
from tcrctl.plant.rig.file import load_rig, read_rig
from tcrctl.plant.rig.mounting import mounting
from tcrctl.plant.rig.operation import Operation
from tcrctl.replay.replay import replay
from tcrctl.robot.description import load_robot

NAMES = ("c1", "c2", "c3", "c4")


@pytest.fixture
def bench(tmp_path, tcr5x4):
    """Writes a bench with one text of its devices replaced; returns its rig file as loaded."""

    def loaded(old="", new=""):
        return load_rig(str(write_bench(tmp_path, tcr5x4, old, new)), load_robot("tcr5x4"))

    return loaded


def answer(capsys, *given):
    code = main([*map(str, given), "--json"])
    return code, json.loads(capsys.readouterr().out)


def members(kind):
    return {name for name in vars(kind) if not name.startswith("_")}


@pytest.mark.parametrize(("section", "protocol"), [("CAMERAS", Cameras), ("DRIVES", Drives)])
def test_the_devices_of_these_tests_have_what_the_protocols_say_and_nothing_else(
    bench, tcr5x4, section, protocol
):
    loaded = bench()
    if section == "CAMERAS":
        made = connect_cameras(loaded, mounting(loaded.mounted, tcr5x4))._made
    else:
        made = connect_drives(loaded, NAMES)._made
    assert {name for name in dir(made) if not name.startswith("_")} == members(protocol)


@pytest.mark.slow
def test_rig_check_says_the_same_as_of_shipped_devices_and_what_they_find_themselves(bench, tcr5x4):
    found = {one.what: one for one in check_rig(bench(), tcr5x4, 0.05)}
    assert {one.what: one.text for one in found.values() if one.exit_code} == {}
    assert found["cameras"].text == "test 1.0, 200 Hz"
    assert found["drives"].text.startswith("at 0.000")
    assert (found["grease"].text, found["lenses"].text[:8]) == ("fresh", "clean in")
    assert "the line is busy 1 %" in found["period"].text
    assert {"frames", "age", "markers", "rings", "calibration", "limits", "round trip", "zeroed"} <= set(
        found
    )


@pytest.mark.slow
def test_every_verb_of_a_rig_works_with_them(bench, capsys, tmp_path):
    rig = bench().path
    code, status = answer(capsys, "rig", "status", rig)
    assert code == 0
    assert status["robots"][0]["cameras"] == {
        "server": "test",
        "frame": pytest.approx(1e6, abs=1e12),
        "markers": 0,
    }
    code, moved = answer(
        capsys, "rig", "jog", rig, "--cable", "c2", "--by-mm", "1", "--speed-mm-s", "20", "--yes"
    )
    assert (code, moved["to_mm"]["c2"]) == (0, pytest.approx(1.0, abs=0.01))
    code, zeroed = answer(capsys, "rig", "zero", rig, "--yes")
    assert (code, zeroed["before_mm"]["c2"], zeroed["after_mm"]["c2"]) == (
        0,
        pytest.approx(1.0, abs=0.01),
        0.0,
    )
    assert answer(capsys, "rig", "reset", rig, "--yes")[0] == 0
    out = tmp_path / "calibrated.yaml"
    code, found = answer(capsys, "rig", "calibrate", rig, "--seconds", "0.2", "--free", "-o", out)
    assert code == 0, found
    np.testing.assert_allclose(found["calibration"]["translation_m"], [0.1, -0.2, 0.3], atol=2e-3)
    assert answer(capsys, "rig", "check", out)[0] == 0


@pytest.mark.slow
def test_a_run_is_recorded_with_their_code_replayed_and_done_again_from_its_folder(bench, tmp_path):
    loaded = bench()
    experiment = prepare(load_spec(str(tmp_path / "bench.yaml")))
    summary = run_experiment(experiment, out=tmp_path / "runs", confirmed=True)
    assert (summary.status, summary.reason) == ("success", "")
    log = read_log(summary.log)
    table = json.loads(log.attachments["plugins.json"][1])
    assert [(row["section"], row["kind"]) for row in table] == [
        ("cameras", "./devices.py:CAMERAS"),
        ("plc", "./devices.py:DRIVES"),
    ]
    assert log.attachments["plugin.devices.py"][1] == (tmp_path / "devices.py").read_bytes()
    frame = next(step.measurement.raw for step in log.steps() if step.measurement.raw is not None)
    assert frame.names.split("\n")[:2] == ["m1.n1", "m1.n2"]
    assert frame.positions.shape == (15, 3)
    assert replay(summary.log).status == "identical"  # no code of devices is needed, and none is run
    shutil.rmtree(loaded.path.parent / "devices.py", ignore_errors=True)
    (tmp_path / "devices.py").unlink()
    again = run_experiment(
        prepare(load_experiment(str(summary.log.parent))), out=tmp_path / "again", confirmed=True
    )
    assert again.status == "success"
    assert read_log(again.log).attachments["plugin.devices.py"] == log.attachments["plugin.devices.py"]


def test_a_loaded_bench_goes_to_another_process_and_back(bench):
    loaded = bench()
    again = pickle.loads(pickle.dumps(loaded))
    assert again == loaded
    assert [origin.kind for origin in again.origins] == ["./devices.py:CAMERAS", "./devices.py:DRIVES"]


def test_show_fills_in_their_defaults_and_what_it_prints_loads_again(bench, capsys):
    path = bench().path
    assert main(["show", "--rig", str(path)]) == 0
    text = capsys.readouterr().out
    assert "rate_hz: 200.0" in text
    assert "watchdog_ms: 500.0" in text
    before = read_rig(str(path))[0]
    path.write_text(text)
    assert read_rig(str(path))[0] == before
    assert main(["show", "--rig", str(path), "--set", "name=x"]) == 2
    assert "--rig goes with neither" in capsys.readouterr().err


REFUSED = {
    "no file": ("", "", "devices.py:CAMERAS", "other.py:CAMERAS", "other.py: cannot be read"),
    "no name": (
        "",
        "",
        "devices.py:DRIVES",
        "devices.py:MOTORS",
        "it defines no MOTORS; kinds in it: CAMERAS",
    ),
    "syntax": ("class FakeCameras:", "class FakeCameras", "", "", "SyntaxError"),
    "missing import": ("import time", "import no_such_package_1", "", "", "no_such_package_1, into the"),
    "raises when loaded": ("CAMERAS = (", "1 / 0; CAMERAS = (", "", "", "ZeroDivisionError"),
    "other base": (
        "CameraKeys(CameraSection)",
        "CameraKeys(DriveSection)",
        "",
        "",
        "derive from CameraSection",
    ),
    "cameras as drives": ("", "", "devices.py:DRIVES", "devices.py:CAMERAS", "must derive from DriveSection"),
    "misspelt key": ("", "", "up_axis: z", "rate_h: 100", "unknown key; did you mean rate_hz?"),
    "out of bounds": ("", "", "DRIVES'", "DRIVES', watchdog_ms: 0", "must be > 0.0, not 0"),
    "not registered": ("", "", "'./devices.py:CAMERAS'", "vicon", "must be 'natnet'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_broken_kind_is_refused_at_its_place_in_the_rig_file(bench, name):
    old, new, rig_old, rig_new, message = REFUSED[name]
    path = bench().path
    path.write_text(path.read_text().replace(rig_old, rig_new) if rig_old else path.read_text())
    code = dedent(DEVICES.format(base={}))
    assert old in code
    (path.parent / "devices.py").write_text(code.replace(old, new, 1) if old else code)
    with pytest.raises(SpecError) as refused:
        read_rig(str(path))
    assert any(message in str(problem) for problem in refused.value.problems), refused.value
    assert all(problem.where.startswith(f"{path}:") for problem in refused.value.problems)


UNBUILT = {
    "builder raises": ("self.rate, self._last =", "1 / 0; self.rate, self._last =", InputError, "ZeroDiv"),
    "cameras cannot be reached": (
        "self.rate, self._last =",
        "raise ConnectionRefusedError('nobody'); self.rate, self._last =",
        DeviceError,
        "nobody",
    ),
    "cameras lack": ("def status(self):\n        return Cam", "def state(self):\n        return Cam", InputError,
                     "a FakeCameras, which has no status"),
    "drives lack": ("def load", "def burden", InputError, "a FakeDrives, which has no load"),
    "no identity": ('Identity("drives", "drives of a test", "test 2.0")', '"me"', DeviceError,
                    "identity returned a str, not a Identity"),
    "rate 0": ("settings.rate_hz, 0", "0.0, 0", InputError, "its rate is 0 Hz"),
    "limits of others": ("np.full(m, -1e5)", "np.full(m + 1, -1e5)", DeviceError, "low that are not 4 numbers"),
    "limits without room": ("np.full(m, -1e5)", "np.full(m, 1e5)", DeviceError, "limits that leave no room"),
    "limits inside the file's": ("np.full(m, -1e5)", "np.full(m, -1e4)", InputError,
                                 "allows more than the drives of a test: cable c1: -20 to 20 mm on axis 1"),
    "no watchdog": ("settings.watchdog_ms / 1e3", "None", ArmingRefusedError, "they have no watchdog"),
    "watchdog faster than the loop": ("settings.watchdog_ms / 1e3", "0.01", InputError, "not shorter than"),
    "watchdog that is no time": ("settings.watchdog_ms / 1e3", "'soon'", DeviceError, "watchdog returned a str"),
    "too slow a line": ("return 0.01", "raise InputError('too slow')", InputError, "too slow"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNBUILT)
def test_a_device_that_cannot_be_used_is_refused_before_anything_moves(bench, tcr5x4, name):
    old, new, kind, message = UNBUILT[name]
    imports = "from tcrctl.extend import (" if "InputError" in new else ""
    loaded = bench(old, new)
    if imports:
        text = (loaded.path.parent / "devices.py").read_text()
        (loaded.path.parent / "devices.py").write_text(text.replace(imports, f"{imports}InputError, "))
        loaded = load_rig(str(loaded.path), load_robot("tcr5x4"))
    with pytest.raises(kind) as refused:
        build_rig(loaded, tcr5x4, 0.05, Operation(confirmed=True))
    assert message in str(refused.value)


RETURN = "return self._finder.sighting("
FRAMES = {
    "raises": (RETURN, f"1 / 0; {RETURN}", "next raised ZeroDivisionError: division by zero (devices.py:"),
    "a number": (RETURN, f"return 1; {RETURN}", "next returned a int, not a Sighting"),
    "from the future": (
        "sighting(k / self.rate",
        "sighting(1 + k / self.rate",
        "s from now on time.monotonic",
    ),
    "at no time": ("sighting(k / self.rate", "sighting(float('nan')", "s from now on time.monotonic"),
    "delay in whole seconds": ("delay=0.001", "delay=0", "next returned a int, not a float"),
    "negative number": ("number=k", "number=-k", "raw.number that is no count"),
}
SPOILT = {
    "nodes of others": ("nodes=seen.nodes[1:]", "nodes that are no float32 of shape (15, 3)"),
    "nodes in doubles": ("nodes=seen.nodes.astype(float)", "nodes that are no float32"),
    "valid NaN": ("nodes=seen.nodes * np.nan", "nodes that are valid and no finite numbers"),
    "valid as numbers": ("valid=seen.valid.astype(int)", "valid that are no bool"),
    "no raw frame": ("raw=None", "a NoneType, not a RawFrame"),
    "raw in doubles": (
        "raw=replace(seen.raw, positions=np.zeros((2, 3)))",
        "raw.positions that are no float32",
    ),
}


def frame_of(loaded, robot):
    cameras = connect_cameras(loaded, mounting(loaded.mounted, robot))
    try:
        return cameras.next(1.0, fresh=True)
    finally:
        cameras.close()


@pytest.mark.parametrize("name", [*FRAMES, *SPOILT])
def test_a_frame_that_cannot_be_is_an_error_of_the_device(bench, tcr5x4, name):
    if name in FRAMES:
        old, new, message = FRAMES[name]
    else:
        change, message = SPOILT[name]
        old, new = (
            RETURN,
            f"seen = self._finder.sighting(0.0, markers); return replace(seen, {change})\n        {RETURN}",
        )
    with pytest.raises(UntrustworthyDeviceError) as refused:
        frame_of(bench(old, new), tcr5x4)
    assert message in str(refused.value)


def test_a_frame_that_repeats_the_last_one_is_none(bench, tcr5x4):
    loaded = bench("2e-5 * self._random.standard_normal(3)", "0.0")
    cameras = connect_cameras(loaded, mounting(loaded.mounted, tcr5x4))
    assert cameras.next(1.0, fresh=True) is not None
    assert cameras.next(1.0, fresh=True) is None


def test_frames_do_not_change_when_the_device_fills_its_arrays_again(bench, tcr5x4):
    again = "global LAST; LAST = self._finder.sighting(k / self.rate, markers, delay=0.0); return LAST"
    loaded = bench(RETURN, f"{again}\n        {RETURN}")
    cameras = connect_cameras(loaded, mounting(loaded.mounted, tcr5x4))
    seen = cameras.next(1.0, fresh=True)
    before = seen.nodes.copy()
    cameras._made.next.__globals__["LAST"].nodes[:] = 7.0
    np.testing.assert_array_equal(seen.nodes, before)


ANSWERS = {
    "raises": ("return self.status()", "1 / 0", UntrustworthyDeviceError, "exchange raised ZeroDivisionError"),
    "does not answer": ("return self.status()", "raise TimeoutError('no answer')", DeviceError, "no answer"),
    "a number": ("return self.status()", "return 1", UntrustworthyDeviceError, "a int, not a DriveStatus"),
    "positions of others": ('STATE["position"].copy(),', 'STATE["position"][1:],', UntrustworthyDeviceError,
                            "positions of shape (3,), not (4,)"),
    "positions in millimetres": ('STATE["position"].copy(),', 'STATE["position"] * 1e-3,',
                                 UntrustworthyDeviceError, "no array of whole micrometres"),
    "fault as a number": ('fault=STATE["fault"]', "fault=7", UntrustworthyDeviceError, "a int, not a str"),
    "bits as text": ("enabled=self._on", "enabled='yes'", UntrustworthyDeviceError, "a str, not a bool"),
}  # fmt: skip


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_that_cannot_be_is_an_error_of_the_device(bench, name):
    old, new, kind, message = ANSWERS[name]
    drives = connect_drives(bench(old, new), NAMES)
    with pytest.raises(kind) as refused:
        drives.exchange(np.zeros(4, np.int64), DriveControl())
    assert type(refused.value) is kind
    assert message in str(refused.value)


STOPPED = {
    "cameras raise": ("wait = k", "if k > LATE: 1 / 0\n        wait = k", "next raised ZeroDivisionError"),
    "drives raise": ("self._was_zero = control.zero", "self._was_zero = control.zero\n        if control.follow "
                     "and time.monotonic() * 200 > LATE: 1 / 0", "exchange raised ZeroDivisionError"),
    "drives report nonsense": ("self._was_zero = control.zero", "self._was_zero = control.zero\n        if "
                               "control.follow and time.monotonic() * 200 > LATE: return None", "a NoneType, not"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", STOPPED)
def test_a_device_that_fails_in_mid_run_is_a_safe_stop_with_a_finished_log(bench, tmp_path, name):
    old, new, message = STOPPED[name]
    bench(old, new)
    code = (tmp_path / "devices.py").read_text()
    late = "LATE = time.monotonic() * 200 + 1e9"
    (tmp_path / "devices.py").write_text(code.replace("STATE = {", f"{late}\nSTATE = {{", 1))
    experiment = prepare(load_spec(str(tmp_path / "bench.yaml"), ("trajectory.duration_s=2",)))
    module = experiment.loaded.rig.rig.cameras.plugin.build.__init__.__globals__

    def spoil(done, total):
        if done == 5:
            module["LATE"] = 0.0

    summary = run_experiment(experiment, out=tmp_path / "runs", confirmed=True, progress=spoil)
    assert summary.exit_code == 5
    assert message in summary.reason
    log = read_log(summary.log)
    assert log.complete
    assert 5 <= len(list(log.steps())) < 40


@pytest.mark.slow
def test_kinds_of_installed_packages_are_listed_and_in_the_schema(bench, tmp_path, monkeypatch, capsys):
    bench()
    site = tmp_path / "site"
    info = site / "tcr_test_devices-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: tcr-test-devices\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[tcrctl.cameras]\ntest_cameras = tcr_test_devices:CAMERAS\n"
        "[tcrctl.drives]\ntest_drives = tcr_test_devices:DRIVES\nlost = tcr_test_devices:LOST\n"
    )
    shutil.copy(tmp_path / "devices.py", site / "tcr_test_devices.py")
    monkeypatch.syspath_prepend(str(site))
    assert main(["kinds", "--json"]) == 0
    rows = {(row["section"], row["kind"]): row for row in json.loads(capsys.readouterr().out)}
    assert rows["cameras", "natnet"]["from"] == rows["plc", "modbus_rtu"]["from"] == "tcrctl"
    assert rows["cameras", "test_cameras"]["description"] == "Cameras of a test."
    assert rows["plc", "test_drives"]["from"] == "tcr-test-devices 1.0"
    assert rows["plc", "lost"]["description"].startswith("cannot be used: plc.kind: lost: it defines no LOST")
    assert main(["schema", "--rig"]) == 0
    schema = json.dumps(json.loads(capsys.readouterr().out))
    assert '"test_cameras"' in schema
    assert '"test_drives"' in schema
    path = tmp_path / "own.yaml"
    path.write_text(path.read_text().replace("'./devices.py:CAMERAS'", "test_cameras"))
    assert read_rig(str(path))[0].cameras.kind == "test_cameras"
