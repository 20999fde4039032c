"""Accuracy and repeatability of poses and paths by ISO 9283, of runs of which they are known."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from support.short_runs import short_spec
from tcrctl.analysis.accuracy import accuracy_of
from tcrctl.cli.app import main
from tcrctl.errors import InputError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment

PERIOD = 0.05
UP, LEANT = np.array([0.0, 0.0, 1.0]), np.array([0.0, np.sin(0.1), np.cos(0.1)])
A, B, C = (np.append([x, 0.0, 0.0], UP) for x in (0.0, 0.06, 0.12))
TURNED = np.append([0.06, 0.0, 0.0], LEANT)


def history(*poses, off=lambda visit, pose: np.zeros(6), during=lambda s: np.zeros((len(s), 3))):
    """A run from pose to pose, 1 s of rest and 1 s of motion; what is added in a rest, and on the way."""
    wanted, attained = [], []
    for visit, (pose, following) in enumerate(zip(poses, (*poses[1:], None), strict=True)):
        rest = np.tile(pose, (20, 1))
        wanted.append(rest)
        attained.append(rest + off(visit, pose))
        if following is not None:
            s = (np.arange(1, 20) / 20)[:, None]
            way = pose + s * (following - pose)
            way[:, 3:] /= np.linalg.norm(way[:, 3:], axis=1, keepdims=True)
            wanted.append(way)
            attained.append(way + np.hstack([during(s), np.zeros((19, 3))]))
    wanted, attained = np.vstack(wanted), np.vstack(attained)
    attained[:, 3:] /= np.linalg.norm(attained[:, 3:], axis=1, keepdims=True)
    n = len(wanted)
    return SimpleNamespace(
        t=PERIOD * np.arange(n), period=np.full(n, PERIOD), simulated=True, position=attained[:, :3],
        normal=attained[:, 3:], wanted_position=wanted[:, :3], wanted_normal=wanted[:, 3:],
    )  # fmt: skip


def shifted(*offsets_mm):
    """What is added in every stay, the first included, along y."""
    return lambda visit, pose: np.array([0.0, 1e-3 * offsets_mm[visit], 0.0, 0.0, 0.0, 0.0])


def test_what_is_always_wrong_by_the_same_is_inaccurate_and_repeats():
    run = history(A, B, A, B, A, B, A, off=lambda visit, pose: np.array([2e-3, 0, 0, 0, 0, 0]))
    for pose in accuracy_of([run]).poses:
        assert (pose.accuracy_mm, pose.repeatability_mm, pose.drift_mm) == pytest.approx(
            (2.0, 0.0, 0.0), abs=1e-9
        )
        assert (pose.accuracy_deg, pose.repeatability_deg) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_repeatability_is_the_mean_distance_and_three_standard_deviations():
    found = accuracy_of([history(A, B, A, B, A, B, off=shifted(0, 1, 0, 2, 0, 6))]).poses
    of_b = next(pose for pose in found if pose.visits == 3)
    apart = np.abs(np.array([1.0, 2.0, 6.0]) - 3.0)
    assert of_b.accuracy_mm == pytest.approx(3.0)
    assert of_b.repeatability_mm == pytest.approx(apart.mean() + 3.0 * np.std(apart, ddof=1))
    assert of_b.drift_mm == pytest.approx(5.0)


def test_what_depends_on_where_it_comes_from_is_told_apart():
    run = history(
        A, B, C, B, A, B, C, B, off=lambda visit, pose: shifted(*[0, 1, 0, -1, 0, 1, 0, -1])(visit, pose)
    )
    of_b = next(pose for pose in accuracy_of([run]).poses if pose.directions == 2)
    assert of_b.visits == 4
    assert of_b.variation_mm == pytest.approx(2.0)
    assert of_b.accuracy_mm == pytest.approx(0.0, abs=1e-9)


def test_the_normal_has_its_own_measures():
    def leans(visit, pose):
        return np.append(np.zeros(3), (0.0, 0.01, 0.0) if visit else (0.0, 0.0, 0.0))

    *_, pose = accuracy_of([history(A, B, A, B, off=leans)]).poses
    assert pose.accuracy_deg == pytest.approx(np.degrees(np.arctan(0.01)), rel=1e-6)
    assert pose.repeatability_deg == pytest.approx(0.0, abs=1e-6)
    same_place = accuracy_of([history(A, B, A, TURNED)]).poses
    assert [p.pose for p in same_place] == [0, 1, 2], "the same place with another normal is another pose"


def test_a_path_is_compared_at_the_same_time_and_with_itself():
    def bows(height_mm):
        return lambda s: 1e-3 * height_mm * np.hstack([0.0 * s, np.sin(np.pi * s), 0.0 * s])

    runs = [history(A, B, during=bows(height)) for height in (1.0, 3.0)]
    (path,) = accuracy_of(runs).paths
    assert (path.origin, path.pose, path.passes) == (0, 1, 2)
    assert path.accuracy_mm == pytest.approx(2.0, rel=0.01)
    assert path.repeatability_mm == pytest.approx(1.0, rel=0.01), "both are 1 mm off, so their spread is none"


def test_several_logs_are_repetitions():
    runs = [history(A, B, off=shifted(0, 0, 0)), history(A, B, off=shifted(0, 2, 0))]
    (pose,) = accuracy_of(runs).poses
    assert (pose.visits, pose.accuracy_mm) == (2, pytest.approx(1.0))


def test_an_orientation_that_is_free_has_no_measures():
    run = history(A, B, A, B)
    run.wanted_normal[:] = np.nan
    found = accuracy_of([run])
    assert all(np.isnan(pose.accuracy_deg) for pose in found.poses)
    assert found.as_json()["poses"][0]["accuracy_deg"] is None


def test_a_run_that_stands_nowhere_is_refused_with_what_to_run():
    with pytest.raises(InputError, match="stands nowhere") as caught:
        accuracy_of([history(A)])
    assert "pose_accuracy" in caught.value.hint


@pytest.mark.slow
def test_the_command_reads_a_log(tmp_path, capsys):
    points = (
        "{kind: waypoints, points: [{offset_mm: [3, 0, 4]}, {offset_mm: [0, 3, 4]}], cycles: 2, ramp_s: 0.3}"
    )
    spec = short_spec(f"trajectory={points}")
    summary = run_experiment(prepare(spec), out=tmp_path)
    assert main(["accuracy", str(summary.log.parent), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["end"] == "true"
    assert [pose["visits"] for pose in found["poses"]] == [2, 2]
    assert all(pose["accuracy_mm"] < 2.0 for pose in found["poses"])
    assert main(["accuracy", str(summary.log)]) == 0
    assert "RP [mm]" in capsys.readouterr().out
