"""Estimators and plants from elsewhere: built-in ones, wrapped, give the same run; broken ones stop it safely."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest

from tcrctl.errors import InputError, PluginStoppedError, SpecError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.experiment.unrecorded import run_unrecorded
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay

EXPERIMENT = """
    name: own
    robot: tcr600
    trajectory: {kind: hold, duration_s: 0.5, offset_mm: [4, 0, 0]}
    controller: {kind: kinematic}
    estimator: {kind: passive_observer}
    plant: {kind: simulated, noise_um: 50}
"""
PARTS = """
    from dataclasses import replace

    import numpy as np
    from tcrctl.estimator.drives import BelievedDrives
    from tcrctl.estimator.passive_observer import build_observer
    from tcrctl.estimator.settings import PassiveObserverSettings
    from tcrctl.extend import Command, EstimatorSection, NotNegative, PlantSection, quantity
    from tcrctl.plant.settings import SimulatedSettings
    from tcrctl.plant.simulated import SimulatedPlant

    class Keys(EstimatorSection):
        stiffness_n_m: float = quantity("N/m", "virtual spring", 1e4, gt=0)

    class Wrapped:
        def __init__(self, settings, robot, period):
            section = PassiveObserverSettings(kind="passive_observer", stiffness_n_m=settings.stiffness_n_m)
            drives = BelievedDrives(None, 0.0, "encoder", period)
            self.inner = build_observer(section, robot, period, None, drives)

        def update(self, measured, applied):
            return self.inner.update(measured, applied)

    class PlantKeys(PlantSection):
        noise_um: NotNegative = quantity("um", "noise of markers", 50.0)

    class WrappedPlant:
        def __init__(self, settings, robot, period, seed):
            section = SimulatedSettings(kind="simulated", noise_um=settings.noise_um)
            self.inner = SimulatedPlant(section, robot, period, seed)
            self.read, self.write, self.truth = self.inner.read, self.inner.write, self.inner.truth

        def close(self):
            self.inner.close()

    WATCH = (Keys, Wrapped)
    PLANT = (PlantKeys, WrappedPlant)
"""
OWN_ESTIMATOR = "estimator.kind=./parts.py:WATCH"
OWN_PLANT = "plant.kind=./parts.py:PLANT"


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Writes an experiment and the file of its parts, with one text replaced; returns the experiment as loaded."""
    monkeypatch.chdir(tmp_path)

    def loaded(*settings, old="", new=""):
        assert old in PARTS
        (tmp_path / "parts.py").write_text(dedent(PARTS).replace(old, new) if old else dedent(PARTS))
        (tmp_path / "own.yaml").write_text(dedent(EXPERIMENT))
        return load_spec(str(tmp_path / "own.yaml"), settings)

    return loaded


def run(loaded, out="runs"):
    return run_experiment(prepare(loaded), out=Path(out))


def numbers(log):
    """Everything of every step that is a number of the loop, as bytes."""
    return [
        tuple(
            np.ascontiguousarray(array).tobytes()
            for array in (s.measurement.nodes, s.estimate.q, s.estimate.v, s.wanted.speed, s.applied.drive)
        )
        for s in read_log(log).steps()
    ]


@pytest.mark.slow
@pytest.mark.parametrize("setting", [OWN_ESTIMATOR, OWN_PLANT])
def test_a_built_in_part_wrapped_as_a_plug_in_gives_the_same_run_bit_for_bit(own, setting):
    built_in, wrapped = run(own()), run(own(setting))
    assert wrapped.status == built_in.status == "success"
    assert len(numbers(wrapped.log)) == 10
    assert numbers(wrapped.log) == numbers(built_in.log)
    assert wrapped.as_json()["position_error_mm"] == built_in.as_json()["position_error_mm"]


@pytest.mark.slow
@pytest.mark.parametrize("setting", [OWN_ESTIMATOR, OWN_PLANT])
def test_its_log_carries_the_code_is_replayed_and_the_run_is_done_again_from_its_folder(
    own, tmp_path, setting
):
    first = run(own(setting)).log
    assert b"class WrappedPlant" in read_log(first).attachments["plugin.parts.py"][1]
    with pytest.raises(SpecError, match="code is not run because a log says so"):
        replay(first)
    assert replay(first, plugins=tmp_path).status == "identical"
    (tmp_path / "parts.py").unlink()
    again = run(load_experiment(str(first.parent)), "again").log
    assert numbers(again) == numbers(first)


@pytest.mark.slow
def test_the_settings_of_an_own_part_count(own):
    soft = run(own(OWN_ESTIMATOR, "estimator.stiffness_n_m=100"))
    assert numbers(soft.log) != numbers(run(own(OWN_ESTIMATOR)).log)
    with pytest.raises(SpecError, match=r"unknown key; did you mean noise_um"):
        own(OWN_PLANT, "plant.noise_mm=1")


UNBUILT = {
    "estimator raises": (OWN_ESTIMATOR, "drives = Bel", "1 / 0; drives = Bel", "ZeroDivisionError"),
    "estimator lacks": (OWN_ESTIMATOR, "def update", "def renew", "a Wrapped, which has no update"),
    "plant raises": (OWN_PLANT, "self.inner = SimulatedPlant(", "self.inner = Nothing(", "NameError"),
    "plant lacks": (OWN_PLANT, "def close", "def leave", "a WrappedPlant, which has no close"),
    "estimator for a plant": ("plant.kind=./parts.py:WATCH", "", "", "must derive from PlantSection"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNBUILT)
def test_a_part_that_cannot_be_built_is_refused_with_one_message_and_no_run(own, tmp_path, name):
    setting, old, new, message = UNBUILT[name]
    with pytest.raises(InputError) as refused:
        run(own(setting, old=old, new=new))
    assert message in str(refused.value)


UPDATE = "return self.inner.update(measured, applied)"
READ = "self.read, self.write, self.truth = self.inner.read, self.inner.write, self.inner.truth"
BROKEN = {
    "estimator raises": (OWN_ESTIMATOR, UPDATE, "return 1 / 0", "update raised ZeroDivisionError"),
    "estimator exits": (OWN_ESTIMATOR, UPDATE, "raise SystemExit(0)", "update raised SystemExit"),
    "no estimate": (OWN_ESTIMATOR, UPDATE, "return None", "update returned a NoneType, not an Estimate"),
    "NaN": (
        OWN_ESTIMATOR,
        UPDATE,
        "found = self.inner.update(measured, applied); return replace(found, q=float('nan') * found.q)",
        "update returned q that is not finite",
    ),
    "shape": (
        OWN_ESTIMATOR,
        UPDATE,
        "return replace(self.inner.update(measured, applied), drive=np.zeros(1))",
        "update returned drive of shape (1,), not (3,)",
    ),
    "text": (
        OWN_ESTIMATOR,
        UPDATE,
        "return replace(self.inner.update(measured, applied), position='here')",
        "update returned position that are no numbers",
    ),
    "plant raises": (
        OWN_PLANT,
        READ,
        READ + "; self.write = lambda command: 1 / 0",
        "write raised ZeroDivisionError",
    ),
    "plant sends nothing": (
        OWN_PLANT,
        READ,
        READ + "; self.write = lambda command: None",
        "write returned a NoneType, not the Command that was sent",
    ),
    "plant sends NaN": (
        OWN_PLANT,
        READ,
        READ + "; self.write = lambda c: Command(c.speed, c.drive * float('nan'))",
        "write returned drive that is not finite",
    ),
    "plant sends too few": (
        OWN_PLANT,
        READ,
        READ + "; self.write = lambda c: Command(c.speed[:2], c.drive)",
        "write returned speed of shape (2,), not (3,)",
    ),
    "plant knows NaN": (
        OWN_PLANT,
        READ,
        READ + "; self.truth = lambda: replace(self.inner.truth(), normal=np.full(3, np.nan))",
        "truth returned normal that is not finite",
    ),
    "plant's truth": (
        OWN_PLANT,
        READ,
        READ + "; self.truth = lambda: 3",
        "truth returned a int, not a Truth",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BROKEN)
def test_a_part_that_fails_in_mid_run_is_a_safe_stop_with_a_finished_log(own, name):
    setting, old, new, message = BROKEN[name]
    summary = run(own(setting, old=old, new=new))
    assert (summary.status, summary.exit_code) == ("aborted", 4), summary.reason
    assert message in summary.reason
    assert read_log(summary.log).complete


@pytest.mark.slow
@pytest.mark.parametrize("stalled_s", [0.0, 0.4])
def test_a_step_that_stalled_and_ended_the_run_is_not_recorded_but_told(own, stalled_s):
    """Its lateness and time are in no step, so an event has to say where they went."""
    stall = f"self.write = lambda c: (__import__('time').sleep({stalled_s}), 1 / 0)"
    summary = run_experiment(
        prepare(own(OWN_PLANT, old=READ, new=f"{READ}; {stall}")), out=Path("runs"), realtime=True
    )
    told = [event for event in read_log(summary.log).events() if event.kind == "late"]
    behind = [float(event.message.split()[3]) for event in told]
    assert summary.exit_code == 4
    assert [s for s in behind if s > 0.35] == (behind if stalled_s else [])
    assert len(behind) == 1 or not stalled_s


UNREADABLE = {
    "raises": ("self.read = lambda: 1 / 0", "read raised ZeroDivisionError"),
    "double precision": (
        "self.read = lambda: replace(self.inner.read(), nodes=self.inner.read().nodes.astype(float))",
        "read returned nodes that are no float32 of shape",
    ),
    "NaN": (
        "self.read = lambda: replace(self.inner.read(), drive=np.full(3, np.nan))",
        "read returned values that are no finite numbers",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNREADABLE)
def test_a_plant_that_cannot_be_measured_is_told_and_leaves_no_run(own, tmp_path, name):
    new, message = UNREADABLE[name]
    with pytest.raises(PluginStoppedError) as stopped:
        run(own(OWN_PLANT, old=READ, new=f"{READ}; {new}"))
    assert message in str(stopped.value)
    assert list((tmp_path / "runs").glob("*")) == []


START = {"start": "self.start = lambda: 1 / 0", "close": "self.close = lambda: 1 / 0"}


@pytest.mark.slow
@pytest.mark.parametrize("name", START)
def test_a_plant_that_cannot_be_started_or_closed_is_a_finished_log_that_says_so(own, name):
    summary = run(own(OWN_PLANT, old=READ, new=f"{READ}; {START[name]}"))
    assert (summary.status, summary.exit_code) == ("aborted", 4)
    assert f"{name} raised ZeroDivisionError" in summary.reason
    assert read_log(summary.log).complete
    assert len(list(read_log(summary.log).steps())) == (0 if name == "start" else 10)


ALTERED = {
    "estimator changes what it gets": (
        OWN_ESTIMATOR,
        UPDATE,
        "found = self.inner.update(measured, applied); measured.nodes[:] = applied.speed[:] = 7; return found",
    ),
    "plant fills its arrays again": (
        OWN_PLANT,
        READ,
        READ + "; frame = self.inner.read(); self.read = lambda: again(frame, self.inner.read())",
    ),
}
AGAIN = """
def again(frame, new):
    frame.nodes[:], frame.valid[:], frame.drive[:] = new.nodes, new.valid, new.drive
    return replace(frame, t=new.t)
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ALTERED)
def test_what_is_recorded_is_what_was_measured_whatever_becomes_of_the_arrays(own, tmp_path, name):
    setting, old, new = ALTERED[name]
    noiseless = ("plant.noise_um=0",)
    wanted = numbers(run(own(*noiseless)).log)
    own(old=old, new=new)
    with (tmp_path / "parts.py").open("a") as file:
        file.write(AGAIN)
    assert numbers(run(load_spec(str(tmp_path / "own.yaml"), (setting, *noiseless))).log) == wanted


@pytest.mark.slow
def test_a_run_of_a_study_starts_and_closes_the_plant_as_a_recorded_one_does(own, tmp_path):
    noted = READ + "; self.start = lambda: open('started', 'x').close()"
    loaded = own(OWN_PLANT, old=READ, new=noted)
    unrecorded = run_unrecorded(prepare(loaded))
    assert unrecorded.status == "success"
    (tmp_path / "started").unlink()
    assert run(loaded).as_json()["position_error_mm"] == unrecorded.as_json()["position_error_mm"]
    (tmp_path / "started").unlink()
    stuck = own(OWN_PLANT, old="self.inner.close()", new="raise ValueError('stuck')")
    assert "close raised ValueError: stuck" in run_unrecorded(prepare(stuck)).reason
