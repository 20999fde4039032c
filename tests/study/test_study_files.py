"""Study files: what they mean, and what is refused, located, before anything runs."""

from __future__ import annotations

import itertools
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.studies import SOFT, quick_study, study_file
from tcrctl.cli.app import main
from tcrctl.config import shipped
from tcrctl.errors import SpecError
from tcrctl.study.axes import NormalSettings, RangeSettings
from tcrctl.study.command_line import told_study
from tcrctl.study.design import cells
from tcrctl.study.loading import load_study, narrowed
from tcrctl.study.plan import planned
from tcrctl.study.settings import StudySpec


def spec(**given):
    return StudySpec.model_validate_json(
        json.dumps({"kind": "study", "name": "s", "experiments": ["letter_t"], **given})
    )


def points(**given):
    return [tuple(cell.values.values()) for cell in cells(spec(**given))]


def test_a_grid_is_every_combination_and_a_zip_goes_side_by_side():
    vary = {"a": [1, 2, 3], "b": ["x", "y", "z"]}
    assert points(vary=vary) == list(itertools.product([1, 2, 3], "xyz"))
    assert points(vary=vary, design="zip") == [(1, "x"), (2, "y"), (3, "z")]
    assert points(vary={"a": {"low": 1.0, "high": 100.0, "scale": "log", "steps": 3}}) == [
        (1.0,),
        (10.0,),
        (100.0,),
    ]


@pytest.mark.parametrize("design", ["random", "sobol", "latin"])
def test_a_drawn_design_stays_within_its_ranges_and_is_the_same_every_time(design):
    vary = {
        "a": {"low": 2, "high": 5},
        "b": {"low": 1e-3, "high": 1.0, "scale": "log"},
        "c": {"mean": 0, "std": 1},
    }
    drawn = points(vary=vary, design=design, samples=23)
    assert len(set(drawn)) == 23
    assert all(2 <= a <= 5 and 1e-3 <= b <= 1.0 and abs(c) <= 3.0 for a, b, c in drawn)
    assert drawn == points(vary=vary, design=design, samples=23)
    assert drawn != points(vary=vary, design=design, samples=23, design_seed=1)


def test_a_latin_square_has_one_value_in_every_stratum():
    drawn = points(vary={"a": {"low": 0, "high": 10}}, design="latin", samples=10)
    assert sorted(int(a) for (a,) in drawn) == list(range(10))


@given(st.integers(0, 50), st.integers(1, 50))
def test_seeds_are_written_as_they_are_read(first, count):
    text = f"{first}..{first + count - 1}"
    made = spec(seeds=text)
    assert made.seeds == tuple(range(first, first + count))
    assert made.model_dump(mode="json")["seeds"] == text
    assert made.runs == count


def test_a_case_wins_over_what_all_runs_have():
    made = spec(set={"a": 1, "b": 1}, cases={"one": {}, "two": {"b": 2}}, vary={"c": [3]})
    one, two = cells(made)
    assert one.changes(made) == {"a": 1, "b": 1, "c": 3}
    assert two.changes(made) == {"a": 1, "b": 2, "c": 3}


BAD = {
    "an unknown key in vary": ({"vary": {"controller.periods": [0.05]}}, "vary", "did you mean period_s"),
    "a value that is not allowed": (
        {"vary": {"controller.prediction.horizon_s": [0.8, -1.0]}}, "vary", "must be > 0",
    ),
    "an empty list": ({"vary": {SOFT: []}}, "vary", "at least 1"),
    "an empty range": ({"vary": {SOFT: {"low": 2, "high": 1, "steps": 3}}}, "vary", "must be above low"),
    "no seeds": ({"seeds": "5..3"}, "seeds", "1 to 1000000 seeds; this is 0"),
    "two keys that exclude one another": (
        {"vary": {"plant.mismatch": ["off"], SOFT: [1.0]}}, "vary", "excludes plant.mismatch",
    ),
    "a case that excludes what varies": (
        {"vary": {SOFT: [1.0]}, "cases": {"a": {"plant.mismatch": "off"}}}, "cases", "excludes " + SOFT,
    ),
    "a grid of a billion": (
        {"vary": {f"k{i}": {"low": 0, "high": 1, "steps": 1000} for i in range(3)}}, "vary", "1000000000 runs",
    ),
    "a study in a study": ({"experiments": ["letter_t", "realistic"]}, "experiments", "is a study"),
    "the same experiment twice": ({"experiments": ["letter_t", "letter_t"]}, "experiments", "is letter_t"),
    "an experiment that is not there": ({"experiments": ["letter_x"]}, "experiments", "there is no experiment"),
    "a seed that varies as a key": ({"vary": {"seed": [1, 2]}}, "vary", "varied by seeds"),
    "unequal lists in a zip": (
        {"vary": {SOFT: [1.0], "plant.noise_um": [1, 2]}, "design": "zip"}, "vary", "zip needs as many",
    ),
    "a design without samples": ({"vary": {SOFT: {"low": 1, "high": 2}}, "design": "sobol"}, "", "required with"),
    "a range without steps in a grid": ({"vary": {SOFT: {"low": 1, "high": 2}}}, "vary", "required with design"),
    "a measure that there is not": ({"measures": ["position_error_mm.maximum"]}, "measures", "did you mean"),
    "a comparison with nothing": (
        {"cases": {"a": {}}, "compare": {"factor": "case", "against": "b"}}, "compare", "is no case",
    ),
    "an unknown key at the top": ({"sets": {}}, "sets", "unknown key"),
    "an unknown key in what all runs have": ({"set": {"plant.nois_um": 1}}, "set", "did you mean noise_um"),
    "an unknown key in a case": ({"cases": {"a": {"controler.kind": "ioc"}}}, "cases", "did you mean controller"),
    "no key": ({"vary": {"": [1]}}, "vary", "must be a dotted key"),
    "half a key": ({"vary": {"plant..noise_um": [1]}}, "vary", "must be a dotted key"),
    "a key with a blank": ({"cases": {"a": {"plant.noise_um ": 1}}}, "cases", "must be a dotted key"),
    "a value that is no list": ({"vary": {SOFT: 0.8}}, "vary", "must be a list"),
    "text that is no list": ({"vary": {SOFT: "0.8"}}, "vary", "must be a list"),
    "a range of one point": ({"vary": {SOFT: {"low": 1, "high": 1, "steps": 3}}}, "vary", "must be above low"),
    "a range without a step": ({"vary": {SOFT: {"low": 1, "high": 2, "steps": 0}}}, "vary", "must be >= 2"),
    "a range from nothing on, by its log": (
        {"vary": {SOFT: {"low": 0, "high": 1, "steps": 3, "scale": "log"}}}, "vary", "must be > 0 with scale",
    ),
    "a distribution of one point": (
        {"vary": {SOFT: {"mean": 1, "std": 0}}, "design": "random", "samples": 3}, "vary", "must be > 0",
    ),
    "an empty list of seeds": ({"seeds": []}, "seeds", "at least 1"),
    "a key that all runs have and that varies": (
        {"set": {"plant.noise_um": 1}, "vary": {"plant.noise_um": [1]}}, "set", "is varied too",
    ),
    "a key that a section replaces which varies": (
        {"set": {SOFT: 0.8}, "vary": {"plant.mismatch": ["off"]}}, "set", "is replaced by plant.mismatch",
    ),
    "a key that a later section replaces": (
        {"cases": {"a": {SOFT: 0.8, "plant.mismatch": "off"}}}, "cases", "is replaced by plant.mismatch",
    ),
    "the same value twice": ({"vary": {SOFT: [0.8, 1.0, 0.8]}}, "vary", "would count as two"),
    "the same seed twice": ({"seeds": [3, 1, 3]}, "seeds", "seed 3 is given twice"),
    "a billion seeds": ({"seeds": "0..999999999"}, "seeds", "this is 1000000000"),
    "a billion samples": (
        {"vary": {SOFT: {"low": 1, "high": 2}}, "design": "sobol", "samples": 10**9}, "samples", "<= 1000000",
    ),
    "a grid of more combinations than a number has bits": (
        {"vary": {f"k{i}": [1, 2] for i in range(70)}}, "vary", f"{2**70} runs",
    ),
    "itself": ({"experiments": ["./quick.yaml"]}, "experiments", "is a study"),
    "an identification in a study": ({"experiments": ["identify_table2"]}, "experiments", "is an identification"),
    "no experiments": ({"experiments": []}, "experiments", "at least 1"),
    "a study made by a key": ({"vary": {"kind": ["study"]}}, "vary", "unknown key"),
    "a rig": (
        {"set": {"plant": {"kind": "rig", "rig": "loopback"}}}, "experiments", "studies simulate",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_located_message_and_exit_code_2(name, tmp_path, capsys):
    changes, section, message = BAD[name]
    path = study_file(tmp_path, **changes)
    assert main(["validate", str(path)]) == 2
    (line, *rest) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert rest == []
    lines = path.read_text().splitlines()
    row = int(line.removeprefix(f"error: {path}:").partition(":")[0])
    begin = next((i for i, text in enumerate(lines, 1) if text.startswith(f"{section}:")), 1)
    assert begin <= row <= len(lines)
    assert message in line
    assert main(["sweep", str(path), "--out", str(tmp_path / "logs")]) == 2
    assert not (tmp_path / "logs").exists()


def test_side_by_side_and_in_different_kinds_values_may_repeat():
    assert points(vary={"a": [1, 1, 2], "b": [1, 2, 2]}, design="zip") == [(1, 1), (1, 2), (2, 2)]
    assert points(vary={"a": [1, 1.0, True, "1"]}) == [(1,), (1.0,), (True,), ("1",)]


def test_a_study_is_no_experiment_and_says_how_it_is_started(capsys):
    assert main(["run", "realistic", "--dry-run"]) == 2
    assert "tcrctl sweep realistic" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped.studies())
def test_every_shipped_study_is_valid_and_shown_whole(name, capsys):
    study = load_study(name)
    assert study.spec.name == name
    assert study.spec.description
    assert next(iter(cells(study.spec)))
    assert main(["show", name, "--json"]) == 0
    assert StudySpec.model_validate_json(capsys.readouterr().out) == study.spec
    assert main(["list", "--json"]) == 0
    assert name in [entry["name"] for entry in json.loads(capsys.readouterr().out)["studies"]]


def test_the_command_line_makes_a_study_of_an_experiment():
    made = told_study("letter_t", [f"{SOFT}=0.8,1", "plant.noise_um=20"], {"seeds": [1, 2]}).spec
    assert dict(made.vary) == {SOFT: (0.8, 1)}
    assert made.set == {"plant.noise_um": 20}
    assert (made.experiments, made.runs) == (("letter_t",), 4)
    section = told_study("letter_t", ["controller={kind: kinematic, output: position}"]).spec
    assert section.set == {"controller": {"kind": "kinematic", "output": "position"}}
    with pytest.raises(SpecError, match=r"--set controller\.periods: .*unknown key"):
        planned(told_study("letter_t", ["controller.periods=0.05,0.1"]))
    with pytest.raises(SpecError, match="must be key=value"):
        told_study("letter_t", ["controller.period_s"])


def test_a_study_is_narrowed_to_what_is_asked(tmp_path):
    study = quick_study(
        tmp_path, experiments=["letter_t", "letter_i"], cases={"a": {}, "b": {"plant.noise_um": 1}}
    )
    assert narrowed(study, experiments=["letter_i"], cases=["b"]).spec.cells == 1
    with pytest.raises(Exception, match="has no case c; it has a, b"):
        narrowed(study, cases=["c"])


def test_the_schema_knows_studies(capsys):
    assert main(["schema", "--study"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert {"experiments", "vary", "cases", "seeds", "compare"} <= made["properties"].keys()


def test_ranges_and_distributions_are_told_apart_by_their_keys():
    made = spec(vary={"a": {"low": 0, "high": 1}, "b": {"mean": 0, "std": 1}}, design="random", samples=2)
    assert isinstance(made.vary["a"], RangeSettings)
    assert isinstance(made.vary["b"], NormalSettings)
