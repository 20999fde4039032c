"""Tuning lowers what it is asked to lower, on plants that it has not seen, or says that the settings stand."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.engines import stay_here
from support.studies import quick_study, study_file
from tcrctl.cli.app import main
from tcrctl.errors import SpecError
from tcrctl.experiment.spec import load_spec
from tcrctl.study.address import program
from tcrctl.study.axes import RangeSettings
from tcrctl.study.design import Cell
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row
from tcrctl.tune.score import STOPPED, scales, score
from tcrctl.tune.space import Space, space_of

WEIGHT = "controller.weights.speed_change"


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_point_and_its_settings_are_the_same_place(u, v):
    space = Space(
        {"a": RangeSettings(low=2.0, high=5.0), "b": RangeSettings(low=1e-3, high=10.0, scale="log")}
    )
    back = space.point(space.settings([u, v]))
    assert back == pytest.approx([u, v], abs=1e-3)  # four digits
    assert space.settings([u, v, 0.3]) == space.settings([u, v])
    assert space.settings([-1.0, 2.0]) == {"a": 2.0, "b": 10.0}


def runs(values, experiment="letter_t"):
    """Runs with these errors; infinite: stopped."""
    found = []
    for i, value in enumerate(values):
        ended = math.isfinite(value)
        result = {"position_error_mm": {"max": value}} if ended else {}
        cell = Cell(experiment, "c", {})
        planned = PlannedRun(f"{experiment}{i}", {"experiment": experiment, "case": "c"}, i, cell)
        found.append((planned, Row(f"{i}", "success" if ended else "aborted", "", result)))
    return found


def test_the_worst_tenth_counts_and_a_stopped_run_is_worse_than_any_error():
    sizes = scales(runs([1.0, 2.0, 3.0]), "position_error_mm.max")
    assert sizes == {"letter_t": 2.0}
    assert (
        score(runs([float(i) for i in range(1, 21)]), "position_error_mm.max", sizes) == (19 + 20) / 2 / 2.0
    )
    assert score(runs([1.0, 8.0]), "position_error_mm.max", sizes) == 4.0
    assert score(runs([1.0, math.inf]), "position_error_mm.max", sizes) == STOPPED


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=30), st.floats(1.0, 10.0))
def test_making_every_run_worse_never_lowers_the_score(values, factor):
    sizes = {"letter_t": 1.0}
    worse = [factor * value for value in values]
    assert score(runs(worse), "position_error_mm.max", sizes) >= score(
        runs(values), "position_error_mm.max", sizes
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vary": {WEIGHT: [1.0, 2.0]}, "seeds": "0..1"}, "must be a range"),
        ({"seeds": "0..1"}, "there is nothing"),
        ({"vary": {WEIGHT: {"low": 1, "high": 2, "steps": 2}}}, "required: the plants"),
        (
            {"vary": {WEIGHT: {"low": 1, "high": 2, "steps": 2}}, "cases": {"a": {}}, "seeds": "0..1"},
            "candidates",
        ),
    ],
)
def test_a_study_that_cannot_be_tuned_says_where_and_why(changes, message, tmp_path):
    study = quick_study(tmp_path, **changes)
    with pytest.raises(SpecError, match=message):
        space_of(study.spec, study.document)


@pytest.mark.slow
def test_a_bad_setting_is_found_out_and_the_file_that_is_written_is_better(tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    text = load_spec("letter_t").path.read_text().replace("speed_change: 220", "speed_change: 2.0e5")
    (tmp_path / "sluggish.yaml").write_text(text.replace("name: letter_t", "name: sluggish"))
    study = study_file(
        tmp_path, experiments=["./sluggish.yaml"], seeds=[0],
        vary={WEIGHT: {"low": 200, "high": 200000, "scale": "log", "steps": 2}},
    )  # fmt: skip
    order = [
        "tune",
        str(study),
        "--generations",
        "2",
        "--population",
        "3",
        "--jobs",
        "1",
        "--json",
        "--quiet",
    ]
    assert main([*order, "--out", str(tmp_path)]) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["better"]
    assert made["settings"][WEIGHT] < 1e5
    assert made["best"] == sorted(made["best"], reverse=True)
    judged = made["held_out_worst_decile"]
    assert judged["after"] < 0.8 * judged["before"]  # a weight 57 times too large costs more than half
    written = load_spec(made["files"][0]).spec
    assert written.controller.weights.speed_change == made["settings"][WEIGHT]
    assert "quick" in written.source
    assert main([*order, "--out", str(tmp_path)]) == 0  # all its runs are in the store
    again = json.loads(capsys.readouterr().out)
    assert again == made


@pytest.mark.parametrize("lost", ["shipped", "tuned"])
def test_runs_without_a_result_are_no_proof_that_settings_are_better(lost, tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)

    def pretended(order):
        tuned = order.loaded.spec.controller.weights.speed_change < 100.0
        fallen = order.seed == 1 and tuned == (lost == "tuned")
        result = {} if fallen else {"position_error_mm": {"max": 0.5 if tuned else 1.0}}
        return Row(order.address, "crashed" if fallen else "success", "", result, program=program())

    monkeypatch.setattr("tcrctl.study.sweep.do", pretended)
    path = study_file(tmp_path, seeds=[0], vary={WEIGHT: {"low": 1, "high": 90, "steps": 2}})
    order = ["tune", str(path), "--generations", "1", "--population", "3", "--jobs", "1"]
    assert main([*order, "--json", "--quiet", "--out", str(tmp_path)]) == 3
    made = json.loads(capsys.readouterr().out)
    assert (made["status"], made["better"], made["files"]) == ("failed", False, [])
    assert made["reason"] == "1 of 3 runs without a result: 1 crashed"
    monkeypatch.setenv("COLUMNS", "60")
    main([*order, "--out", str(tmp_path)])
    told = capsys.readouterr()
    assert max(len(line) for line in told.out.splitlines() if len(line.split()) > 1) <= 60
    assert "worst decile" in told.out


def test_a_plant_is_never_its_own_judge(tmp_path, capsys):
    study = study_file(tmp_path, seeds="0..3", vary={WEIGHT: {"low": 1, "high": 2, "steps": 2}})
    assert main(["tune", str(study), "--held-out", "3..5", "--out", str(tmp_path)]) == 2
    assert "must not be those" in capsys.readouterr().err
