"""A path as a function of time: sampled once, kept with the run, and never called again."""

from __future__ import annotations

from textwrap import dedent

import numpy as np
import pytest

from tcrctl.errors import SpecError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import make_trajectory, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.experiment.unrecorded import run_unrecorded
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay
from tcrctl.robot.robot import build_robot
from tcrctl.study.address import address

EXPERIMENT = """
    name: own
    robot: tcr600
    trajectory:
      kind: function
      function: './path.py:path'
      duration_s: 0.5
      rate_hz: 40
      origin: rest
      lead_in_s: 0
      settle_s: 0
    controller: {kind: kinematic}
    plant: {kind: simulated}
"""
PATH = """
    import math

    def path(t):
        return 1e-3 * t**2 * (0.5 - t) ** 2, 0.0, 1e-4 * math.sin(math.pi * t)
"""


@pytest.fixture
def own(tmp_path):
    def written(old="", new=""):
        assert old in PATH
        text = dedent(PATH)
        (tmp_path / "path.py").write_text(text.replace(old, new) if old else text)
        (tmp_path / "own.yaml").write_text(dedent(EXPERIMENT))
        return str(tmp_path / "own.yaml")

    return written


def steps(log):
    return [(s.reference.position.tobytes(), s.wanted.speed.tobytes()) for s in read_log(log).steps()]


@pytest.mark.slow
def test_the_path_passes_through_what_the_function_says(own, tcr600):
    loaded = load_spec(own())
    t = np.linspace(0.0, 0.5, 21)
    wanted = np.stack((1e-3 * t**2 * (0.5 - t) ** 2, 0.0 * t, 1e-4 * np.sin(np.pi * t)), axis=1)
    found = make_trajectory(loaded.spec, tcr600).position(t) - tcr600.rest_position
    np.testing.assert_allclose(found, wanted, atol=1e-15)


@pytest.mark.slow
def test_a_run_is_replayed_and_done_again_without_the_code(own, tmp_path):
    first = run_experiment(prepare(load_spec(own())), out=tmp_path / "runs").log
    (tmp_path / "path.py").unlink()
    assert replay(first).status == "identical"
    again = run_experiment(prepare(load_experiment(str(first.parent))), out=tmp_path / "again").log
    assert steps(again) == steps(first)
    kept = read_log(first).attachments["trajectory.csv"][1]
    assert kept.startswith(b"t_s,x_m,y_m,z_m\n0.0,")
    assert len(kept.splitlines()) == 22
    assert read_log(again).attachments["trajectory.csv"][1] == kept
    with pytest.raises(SpecError, match=r"path\.py: cannot be read"):  # other samples need the code
        load_experiment(str(first.parent), ["trajectory.rate_hz=100"])


@pytest.mark.slow
def test_code_in_the_folder_of_a_run_is_not_called(own, tmp_path):
    first = run_experiment(prepare(load_spec(own())), out=tmp_path / "runs").log
    (first.parent / "path.py").write_text("raise SystemExit('called')")
    loaded = load_experiment(str(first.parent))
    assert loaded.spec.trajectory.content == read_log(first).attachments["trajectory.csv"][1]


def test_another_function_is_another_run(own):
    one = address(load_spec(own()), 0, random_path=False)
    assert address(load_spec(own()), 0, random_path=False) == one
    assert address(load_spec(own("1e-3", "2e-3")), 0, random_path=False) != one


def test_a_normal_is_wanted_where_the_function_gives_one(own, tcr600):
    spec = load_spec(own("math.sin(math.pi * t)", "t, 0.0, 0.0, 1.0")).spec
    np.testing.assert_allclose(make_trajectory(spec, tcr600).normal(np.array([0.1])), [[0.0, 0.0, 1.0]])


REFUSED = {
    "raises": (
        "1e-4 *",
        "1 / 0 *",
        "raised ZeroDivisionError: division by zero (path.py:5) at t = 0 s",
    ),
    "raises later": ("(0.5 - t)", "math.sqrt(0.3 - t)", "(path.py:5) at t = 0.3 s"),
    "NaN": ("0.0, 1e-4", "math.nan, 1e-4", "returned values that are no finite numbers at t = 0 s"),
    "two numbers": ("0.0, 1e-4 *", "1e-4 *", "returned shape (2,) at t = 0 s. It must be the end position"),
    "nothing": ("return", "_ =", "returned shape () at t = 0 s"),
    "text": ("0.0, 1e-4", "'a', 1e-4", "returned no numbers at t = 0 s"),
    "no function": ("def path", "def curve", "it defines no function path"),
    "no Python": ("def path", "de path", "SyntaxError"),
    "takes more": ("path(t)", "path(t, u)", "missing 1 required positional argument: 'u'"),
    "jumps": ("0.0, 1e-4", "0.01 * (t > 0.3), 1e-4", "./path.py:path: row 13: jumps by 10 mm"),
    "in mm": ("0.0, 1e-4", "60.0, 1e-4", "is 60 m away"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_wrong_is_told_where_the_experiment_names_it(own, name):
    old, new, message = REFUSED[name]
    with pytest.raises(SpecError) as refused:
        load_spec(own(old, new))
    (problem,) = refused.value.problems
    assert message in str(problem)
    if name not in ("jumps", "in mm"):
        assert "own.yaml:6:3" in problem.where


SETTINGS = {
    "trajectory.function=path.py": "must match the pattern",
    "trajectory.rate_hz=0": "must be > 0",
    "trajectory.duration_s=80000": "must give 4 to 200000 samples, not 3200001",
    "trajectory.rate=5": "did you mean rate_hz",
    "trajectory.function=no_such_module_1:path": "Install what brings the module no_such_module_1",
}


@pytest.mark.parametrize("setting", SETTINGS)
def test_settings_are_strict(own, setting):
    with pytest.raises(SpecError) as refused:
        load_spec(own(), [setting])
    assert SETTINGS[setting] in str(refused.value)


@pytest.mark.thorough
@pytest.mark.slow
def test_samples_of_a_letter_at_20_hz_give_the_errors_of_its_strokes_within_5_percent(tmp_path):
    loaded = load_spec("letter_t")
    strokes = make_trajectory(loaded.spec, build_robot(loaded.robot))
    t = np.arange(round(20.0 * strokes.duration) + 1) / 20.0
    rows = (
        ",".join(map(repr, (a, *b))) for a, b in zip(t.tolist(), strokes.position(t).tolist(), strict=True)
    )
    (tmp_path / "letter.csv").write_text("\n".join(("t_s,x_m,y_m,z_m", *rows)))
    given = loaded.path.read_text()
    kept = given[: given.index("\ntrajectory:")] + given[given.index("\ncontroller:") :]
    table = "\ntrajectory: {kind: table, file: letter.csv, lead_in_s: 0, settle_s: 0}\n"
    (tmp_path / "letter.yaml").write_text(kept + table)
    by_strokes, by_table = (
        run_unrecorded(prepare(load_spec(spec))).as_json()
        for spec in ("letter_t", str(tmp_path / "letter.yaml"))
    )
    assert by_table["status"] == "success"
    for measure in ("max", "rms"):
        wanted = by_strokes["position_error_mm"][measure]
        assert by_table["position_error_mm"][measure] == pytest.approx(wanted, rel=0.05)
