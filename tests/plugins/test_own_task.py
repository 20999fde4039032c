"""Tasks from elsewhere judge runs, name targets and results, and fail safely."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from tcrctl.errors import InputError, SpecError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay

EXPERIMENT = """
    name: own
    robot: tcr600
    trajectory: {kind: waypoints, points: [{target: spot}], lead_in_s: 0, settle_s: 0}
    controller: {kind: kinematic}
    plant: {kind: simulated}
    task: {kind: './task.py:NEAR', radius_mm: 20}
    criteria: ['task.nearest_mm <= 20']
"""
TASK = """
    import numpy as np
    from tcrctl.extend import EndPose, Event, Positive, TaskSection, quantity

    class Keys(TaskSection):
        radius_mm: Positive = quantity("mm", "how near", 5.0)

        def targets(self):
            return {"spot": EndPose(np.array([0.004, 0.0, -0.57]), np.array([0.0, 0.0, 1.0]))}

        @property
        def result_names(self):
            return ("nearest_mm",)

    class Near:
        def __init__(self, settings, targets, rod_diameter):
            self.spot, self.radius = targets["spot"].position, 1e-3 * settings.radius_mm
            self.nearest, self.told = np.inf, False

        def observe(self, step):
            self.nearest = min(self.nearest, np.linalg.norm(step.estimate.position - self.spot))
            if self.nearest > self.radius or self.told:
                return []
            self.told = True
            return [Event(step.t, "near", "info", "near the spot")]

        def result(self):
            return {"nearest_mm": 1e3 * float(self.nearest)}

    NEAR = (Keys, Near)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def loaded(*settings, old="", new=""):
        assert old in TASK
        (tmp_path / "task.py").write_text(dedent(TASK).replace(old, new) if old else dedent(TASK))
        (tmp_path / "own.yaml").write_text(dedent(EXPERIMENT))
        return load_spec(str(tmp_path / "own.yaml"), settings)

    return loaded


def run(loaded):
    return run_experiment(prepare(loaded), out=Path("runs"))


@pytest.mark.slow
def test_a_task_names_the_target_judges_the_run_and_is_kept_with_it(own, tmp_path):
    summary = run(own())
    assert summary.status == "success", summary.reason
    assert 0.0 < summary.as_json()["task"]["nearest_mm"] < 20.0
    log = read_log(summary.log)
    assert "near" in {event.kind for event in log.events()}
    assert replay(summary.log, plugins=tmp_path).status == "identical"
    (tmp_path / "task.py").unlink()
    assert run(load_experiment(str(summary.log.parent))).as_json()["task"] == summary.as_json()["task"]


@pytest.mark.slow
def test_a_criterion_on_its_result_can_be_missed(own):
    summary = run(own("criteria=['task.nearest_mm <= 1e-6']"))
    assert (summary.status, summary.exit_code) == ("failed", 3)


REFUSED = {
    "criteria=['task.far_mm <= 1']": "a run has no result task.far_mm",
    "trajectory.points=[{target: place}]": "the task has no target place; it has spot",
    "task.radius=3": "did you mean radius_mm",
    "task.kind=task.py:FAR": "it defines no FAR; kinds in it: NEAR",
}


@pytest.mark.parametrize("setting", REFUSED)
def test_what_does_not_fit_is_told_at_its_place(own, setting):
    with pytest.raises(SpecError) as refused:
        own(setting)
    assert REFUSED[setting] in str(refused.value)


UNBUILT = {
    "raises": ("self.nearest, self.told = np.inf, False", "1 / 0", "building it raised ZeroDivisionError"),
    "lacks": ("def observe", "def see", "a Near, which has no observe"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", UNBUILT)
def test_one_that_cannot_be_built_is_refused_before_the_run(own, name):
    old, new, message = UNBUILT[name]
    with pytest.raises(InputError) as refused:
        prepare(own(old=old, new=new))
    assert message in str(refused.value)


STOPPED = {
    "observe raises": ("self.told = True", "1 / 0", "observe raised ZeroDivisionError"),
    "no events": ("return []", "return 3", "observe returned a int, not a list of Events"),
    "result raises": ('return {"nearest_mm"', 'return {}[0], {"nearest_mm"', "result raised KeyError"),
    "no dict": (
        'return {"nearest_mm": 1e3 * float(self.nearest)}',
        "return 1",
        "result returned a int, not a dict",
    ),
    "NaN": ("1e3 * float(self.nearest)", "float('nan')", "result returned what is no JSON"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STOPPED)
def test_one_that_fails_in_mid_run_is_a_safe_stop_with_a_finished_log(own, name):
    old, new, message = STOPPED[name]
    summary = run(
        own("task.radius_mm=500" if name == "observe raises" else "task.radius_mm=0.001", old=old, new=new)
    )
    assert (summary.status, summary.exit_code) == ("aborted", 4), summary.reason
    assert message in summary.reason
    assert read_log(summary.log).complete
