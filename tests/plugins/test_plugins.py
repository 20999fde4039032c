"""Kinds from elsewhere run, are recorded and replayed like built-in ones, and a broken one is one clear message."""

from __future__ import annotations

import json
import pickle
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

from tcrctl.cli.app import main
from tcrctl.errors import InputError, SpecError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay

EXAMPLES = Path(__file__).parents[2] / "examples" / "plugins"
SHORT = ("trajectory.duration_s=0.4",)
EXPERIMENT = """
    name: own
    robot: tcr600
    trajectory: {kind: hold, duration_s: 0.2}
    controller: {kind: './own.py:OWN'}
    plant: {kind: simulated}
"""
OWN = """
    import numpy as np
    from tcrctl.extend import Command, OwnControllerSection, quantity

    class Keys(OwnControllerSection):
        gain_1_s: float = quantity("1/s", "gain", 1.0, gt=0)

    class Own:
        def __init__(self, settings, robot):
            self.m = robot.n_cables

        def control(self, estimate, reference):
            return np.zeros(self.m)

    OWN = (Keys, Own)
"""


@pytest.fixture
def own(tmp_path):
    """Writes an experiment and the file that it names, with one text replaced by another."""

    def written(old="", new="", experiment=EXPERIMENT):
        assert old in OWN
        (tmp_path / "own.py").write_text(dedent(OWN).replace(old, new) if old else dedent(OWN))
        (tmp_path / "own.yaml").write_text(dedent(experiment))
        return str(tmp_path / "own.yaml")

    return written


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Installs a package in a folder of its own that registers the module ``own_kind`` under a name."""
    monkeypatch.syspath_prepend(str(tmp_path / "site"))

    def installed(name, point="own_kind", version="1.2"):
        info = tmp_path / "site" / f"{name.replace('-', '_')}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        (info / "top_level.txt").write_text("tcr_test_own_kind\n")
        (info / "entry_points.txt").write_text(f"[tcrctl.controllers]\n{point} = tcr_test_own_kind:OWN\n")
        (info.parent / "tcr_test_own_kind.py").write_text(dedent(OWN))

    return installed


REFUSED = {
    "no file": ("controller.kind=./other.py:OWN", "", "", "other.py: cannot be read"),
    "no name": ("controller.kind=own.py:MINE", "", "", "it defines no MINE; kinds in it: OWN"),
    "syntax": ("", "class Own:", "class Own", "SyntaxError"),
    "missing import": (
        "",
        "import numpy as np",
        "import no_such_package_1",
        "no_such_package_1, into the environment",
    ),
    "raises when loaded": (
        "",
        "OWN = (Keys, Own)",
        "OWN = 1 / 0",
        "ZeroDivisionError: division by zero (own.py:15)",
    ),
    "exits when loaded": ("", "OWN = (Keys, Own)", "raise SystemExit(3)", "SystemExit: 3 (own.py:15)"),
    "no pair": ("", "OWN = (Keys, Own)", "OWN = Own", "must be a pair (Settings, build), not a type"),
    "other base": ("", "Keys(OwnControllerSection)", "Keys", "Keys, must derive from OwnControllerSection"),
    "no builder": ("", "(Keys, Own)", "(Keys, 'Own')", "its builder, 'Own', cannot be called"),
    "misspelt key": ("controller.gain_1s=2", "", "", "unknown key; did you mean gain_1_s?"),
    "value out of bounds": ("controller.gain_1_s=-1", "", "", "must be > 0.0, not -1"),
    "not registered": (
        "controller.kind=pid",
        "",
        "",
        "must be one of 'ioc', 'kinematic', 'open_loop', not \"pid\"",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_broken_kind_is_refused_with_one_message_at_its_place(own, monkeypatch, tmp_path, name):
    setting, old, new, message = REFUSED[name]
    spec = own(old, new)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SpecError) as refused:
        load_spec(spec, (setting,) if setting else ())
    (problem,) = refused.value.problems
    assert message in str(problem)
    assert problem.where.startswith("--set" if setting else f"{spec}:5:")


UNBUILT = {
    "raises": (
        "self.m = robot.n_cables",
        "raise ValueError('too stiff')",
        "ValueError: too stiff (own.py:10)",
    ),
    "lacks": ("def control", "def command", "returned a Own, which has no control"),
    "no instants": ("self.m =", "self.ahead = 'soon'; self.m =", "building it raised ValueError"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNBUILT)
def test_one_that_cannot_be_built_is_refused_before_the_run(own, name):
    old, new, message = UNBUILT[name]
    with pytest.raises(InputError) as refused:
        prepare(load_spec(own(old, new)))
    assert message in str(refused.value)


STOPPED = {
    "raises": ("np.zeros(self.m)", "1 / 0", "control raised ZeroDivisionError: division by zero (own.py:13)"),
    "NaN": ("np.zeros(self.m)", "np.full(self.m, np.nan)", "commands that are no finite numbers"),
    "shape": ("np.zeros(self.m)", "np.zeros(self.m + 1)", "control returned speed of shape (4,), not (3,)"),
    "nothing": ("np.zeros(self.m)", "None", "control returned speed of shape (), not (3,)"),
    "text": ("np.zeros(self.m)", "'stop'", "control returned a str as speed, not numbers"),
    "no info": ("np.zeros(self.m)", "np.zeros(self.m), 1", "a int beside the command, not a ControlInfo"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STOPPED)
def test_one_that_fails_while_it_runs_is_a_safe_stop_with_a_finished_log(own, tmp_path, name):
    old, new, message = STOPPED[name]
    summary = run_experiment(prepare(load_spec(own(old, new))), out=tmp_path / "runs")
    assert (summary.status, summary.exit_code) == ("aborted", 4)
    assert message in summary.reason
    assert read_log(summary.log).complete


@pytest.mark.slow
def test_speeds_beyond_the_limit_are_cut(own, tmp_path):
    spec = own("np.zeros(self.m)", "np.ones(self.m)")
    summary = run_experiment(
        prepare(load_spec(spec, ("safety.position_error_mm=500",))), out=tmp_path / "runs"
    )
    for step in read_log(summary.log).steps():
        assert step.wanted.speed.max() == pytest.approx(0.05)


@pytest.mark.slow
def test_the_example_holds_its_criterion_and_its_replay_is_identical_where_the_code_is_at_hand(tmp_path):
    summary = run_experiment(prepare(load_spec(str(EXAMPLES / "eight.yaml"))), out=tmp_path)
    assert summary.status == "success"
    found = replay(summary.log, plugins=EXAMPLES)
    assert (found.status, found.steps) == ("identical", 400)
    assert found.environment == ()


@pytest.mark.slow
def test_code_that_a_log_carries_or_names_is_never_run(own, tmp_path, monkeypatch):
    spec = own(
        "OWN = (Keys, Own)",
        f"OWN = (Keys, Own); import pathlib; pathlib.Path({str(tmp_path / 'ran')!r}).touch()",
    )
    log = run_experiment(prepare(load_spec(spec)), out=tmp_path / "runs").log
    assert b"OWN = (Keys, Own); import pathlib" in read_log(log).attachments["plugin.own.py"][1]
    (tmp_path / "ran").unlink()
    for folder in (tmp_path, log.parent):  # nor because a file of that name is near
        monkeypatch.chdir(folder)
        with pytest.raises(SpecError, match="code is not run because a log says so"):
            replay(log)
    assert not (tmp_path / "ran").exists()


@pytest.mark.slow
def test_a_path_in_a_log_leads_nowhere_but_to_the_folder_that_is_given(own, tmp_path):
    far = tmp_path / "far"
    far.mkdir()
    spec = own(experiment=EXPERIMENT.replace("./own.py", "far/own.py"))
    shutil.move(tmp_path / "own.py", far / "own.py")
    log = run_experiment(prepare(load_spec(spec)), out=tmp_path / "runs").log
    with pytest.raises(SpecError, match=r"own\.py: cannot be read"):
        replay(log, plugins=tmp_path)
    assert replay(log, plugins=far).status == "identical"


@pytest.mark.slow
def test_other_code_than_was_recorded_is_named(own, tmp_path):
    log = run_experiment(prepare(load_spec(own())), out=tmp_path / "runs").log
    own("np.zeros(self.m)", "np.full(self.m, 1e-6)")
    found = replay(log, plugins=tmp_path)
    assert found.status == "different"
    (change,) = found.environment
    assert change.name == "controller.kind ./own.py:OWN"
    assert change.recorded != change.now


@pytest.mark.slow
def test_a_run_is_done_again_from_its_folder_with_the_code_it_had(own, tmp_path):
    first = run_experiment(prepare(load_spec(own())), out=tmp_path / "runs")
    own("np.zeros(self.m)", "np.full(self.m, 1e-3)")
    resolved = load_spec(str(first.log.parent / "spec.resolved.yaml"))
    again = run_experiment(prepare(resolved), out=tmp_path / "again")
    steps = zip(read_log(first.log).steps(), read_log(again.log).steps(), strict=True)
    assert all(a.wanted.speed.tobytes() == b.wanted.speed.tobytes() for a, b in steps)


@pytest.mark.slow
def test_a_registered_kind_is_listed_checked_run_and_replayed_without_further_words(
    own, package, tmp_path, capsys
):
    package("tcr-test-lab")
    spec = own(experiment=EXPERIMENT.replace("./own.py:OWN", "own_kind"))
    assert main(["kinds", "--json"]) == 0
    rows = {row["kind"]: row["from"] for row in json.loads(capsys.readouterr().out)}
    assert (rows["own_kind"], rows["ioc"]) == ("tcr-test-lab 1.2", "tcrctl")
    assert main(["schema"]) == 0
    assert '"const": "own_kind"' in capsys.readouterr().out
    log = run_experiment(prepare(load_spec(spec)), out=tmp_path / "runs").log
    (row,) = json.loads(read_log(log).attachments["plugins.json"][1])
    assert (row["package"], row["version"], row["kind"]) == ("tcr-test-lab", "1.2", "own_kind")
    assert replay(log).status == "identical"


def test_two_packages_with_one_name_are_refused_and_named(own, package):
    package("tcr-test-lab")
    package("tcr-test-shop")
    spec = own(experiment=EXPERIMENT.replace("./own.py:OWN", "own_kind"))
    with pytest.raises(SpecError, match=r"registered twice, by tcr-test-lab 1\.2 and tcr-test-shop 1\.2"):
        load_spec(spec)


def test_the_name_of_a_built_in_kind_stays_its_own(own, package, capsys):
    package("tcr-test-lab", "ioc")
    assert main(["kinds"]) == 0
    assert "cannot be used: a built-in kind has this name" in " ".join(capsys.readouterr().out.split())
    assert load_spec(own(experiment=EXPERIMENT.replace("./own.py:OWN", "ioc"))).spec.controller.plugin is None


@pytest.mark.slow
def test_an_experiment_with_kinds_of_a_file_is_itself_in_another_process_whatever_becomes_of_the_file(
    own, tmp_path
):
    loaded = load_spec(own(), ("controller.gain_1_s=3",))
    sent = pickle.dumps(loaded)
    (tmp_path / "own.py").write_text("1 / 0")
    program = (
        "import pickle, sys; loaded = pickle.load(sys.stdin.buffer); c = loaded.spec.controller; "
        "print(c.gain_1_s, c.plugin.build.__name__, loaded.spec.model_dump_json())"
    )
    done = subprocess.run([sys.executable, "-c", program], input=sent, capture_output=True, check=True)
    assert done.stdout.decode().split(" ", 2) == ["3.0", "Own", loaded.spec.model_dump_json() + "\n"]
    assert pickle.loads(sent).spec.controller == loaded.spec.controller
