"""Experiment files: shipped ones are valid, contradictions are refused where they stand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from tcrctl.config import shipped, strict_yaml
from tcrctl.errors import InputError, SpecError, UnknownNameError
from tcrctl.experiment.criterion import RELATIONS, Criterion, CriterionText
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec, load_spec

SPEC = """\
name: standing
robot: tcr600
trajectory: {kind: hold, duration_s: 1}
controller: {kind: ioc}
plant: {kind: simulated}
"""


def loaded(folder: Path, *overrides: str, text: str = SPEC) -> LoadedSpec:
    path = folder / "standing.yaml"
    path.write_text(text)
    return load_spec(str(path), overrides)


def problems_of(folder: Path, *overrides: str, text: str = SPEC) -> list[str]:
    with pytest.raises(SpecError) as caught:
        loaded(folder, *overrides, text=text)
    return [str(problem).replace(str(folder), "") for problem in caught.value.problems]


@pytest.mark.parametrize("name", sorted(shipped.experiments()))
def test_shipped_experiments_are_valid_and_survive_both_file_formats(name: str) -> None:
    found = load_spec(name)
    assert found.spec.name == name
    assert found.spec.description
    assert found.spec.source
    assert found.given_text == shipped.experiments()[name].read_bytes()
    assert ExperimentSpec.model_validate_json(found.spec.model_dump_json()) == found.spec
    text = strict_yaml.dumps(found.spec.model_dump(mode="json"))
    assert strict_yaml.validate(strict_yaml.loads(text), ExperimentSpec) == found.spec


BENCH = SPEC.replace("{kind: ioc}", "{kind: ioc, period_s: 0.1}").replace(
    "{kind: simulated}", "{kind: rig, rig: loopback}"
)


def test_a_period_for_which_the_watchdog_is_too_short_is_refused_where_it_stands(tmp_path: Path) -> None:
    (found,) = problems_of(tmp_path, text=BENCH)
    assert found.startswith("/standing.yaml:4:25: controller.period_s: is 0.1 s; the watchdog of the drives")
    assert "at most 0.0667 s" in found
    (found,) = problems_of(tmp_path, "plant={kind: rig, rig: loopback}", "controller.period_s=0.07")
    assert found.startswith("--set controller.period_s: is 0.07 s")
    assert loaded(tmp_path, "controller.period_s=0.0666", text=BENCH).rig is not None


def test_a_rig_with_a_longer_watchdog_allows_a_longer_period_as_far_as_its_cameras_do(tmp_path: Path) -> None:
    rig = shipped.find_rig("loopback").read_text()
    (tmp_path / "slow.yaml").write_text(rig.replace("port: 15600}", "port: 15600, watchdog_ms: 3000}"))
    text = BENCH.replace("rig: loopback", "rig: ./slow.yaml")
    assert loaded(tmp_path, "controller.period_s=0.4", text=text).rig is not None
    (found,) = problems_of(tmp_path, "controller.period_s=0.5", text=text)
    assert "longer than safety.stale_stop_ms" in found


@pytest.mark.parametrize("section", ["controller.tension", "controller.integral", "plant.mismatch"])
def test_a_section_that_is_off_stays_off_in_the_resolved_file(tmp_path: Path, section: str) -> None:
    spec = loaded(tmp_path, f"{section}=off").spec
    part, key = section.split(".")
    assert getattr(getattr(spec, part), key) is None
    again = ExperimentSpec.model_validate_json(spec.model_dump_json())
    assert again == spec
    assert spec.model_dump(mode="json")[part][key] == "off"


def test_settings_cannot_be_changed_after_loading(tmp_path: Path) -> None:
    spec = loaded(tmp_path).spec
    with pytest.raises(ValidationError):
        spec.controller.period_s = 1.0  # type: ignore[misc]


def test_an_override_takes_part_in_every_check_and_is_remembered(tmp_path: Path) -> None:
    found = loaded(tmp_path, "controller.period_s=1e-1", "plant.measured_rings=[8, 11]")
    assert found.spec.controller.period_s == 0.1
    assert found.spec.plant.measured_rings == (8, 11)
    assert found.overrides == ("controller.period_s=1e-1", "plant.measured_rings=[8, 11]")
    assert found.given_text == SPEC.encode()


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ["controller.prediction.horizon_s=0.01"],
            "--set controller.prediction.horizon_s: must be at least period_s, 0.05, not 0.01",
        ),
        (
            ["controller.period_s=1"],
            "/standing.yaml:4:1: controller.prediction.horizon_s: must be at least period_s, 1, not 0.8",
        ),
        (
            ["controller.prediction.instants=8", "controller.prediction.blocks=9"],
            "--set controller.prediction.blocks: must be at most instants, 8, not 9",
        ),
        (
            ["controller.prediction.instants=61"],
            "--set controller.prediction.instants: must be <= 60, not 61",
        ),
        (["controller.speed_limit_mm_s=0"], "--set controller.speed_limit_mm_s: must be > 0.0, not 0"),
        (
            ["controller.weights.normal=1"],
            "--set controller.weights.normal: has no meaning with output: position",
        ),
        (["controller.output=pose"], "controller.weights.normal: must be > 0 with output: pose"),
        (
            ["controller.tension.floor_n=5"],
            "--set controller.tension.floor_n: must be below reference_n, 5, not 5",
        ),
        (["controller.tension.ceiling_n=4"], "--set controller.tension.ceiling_n: must be above reference_n"),
        (["controller.tension.ceiling_n=101"], "must be at most tension_limit_n of tcr600, 100, not 101"),
        (
            ["controller.tension=no"],
            '--set controller.tension: must be off or a map of keys and values, not "no"',
        ),
        (
            ["controller.model=static", "controller.prediction=one_step"],
            "--set controller.prediction: one_step is a time step of the equations of motion",
        ),
        (
            ["controller.model=static", "controller.prediction.modes=6"],
            "--set controller.prediction.modes: has no meaning with model: static",
        ),
        (
            ["controller.prediction={kind: literal, horizon_s: 0.05}"],
            "controller.prediction.horizon_s: unknown key; allowed: kind",
        ),
        (
            ["controller.prediction={kind: one_step, blocks: 2}"],
            "unknown key; allowed: kind, horizon_s",
        ),
        (
            ["controller.prediction=litteral"],
            "must be one of 'multi_step', 'one_step', 'literal', not \"litteral\"; did you mean literal?",
        ),
        (
            ["controller.horizon_s=0.4"],
            "--set controller.horizon_s: belongs to prediction: write prediction: {kind: multi_step, "
            "horizon_s: ...}; kinds that have it: multi_step, one_step",
        ),
        (
            ["controller.prediction=literal", "controller.modes=4"],
            "--set controller.modes: belongs to prediction: write prediction: {kind: multi_step, modes: ...}",
        ),
        (
            ["controller.kind=open_lop"],
            "--set controller.kind: must be one of 'ioc', 'kinematic', 'open_loop'",
        ),
        (["estimator.kind=exakt"], "--set estimator.kind: must be one of 'passive_observer', 'exact'"),
        (["estimator.kind=exakt"], "did you mean exact?"),
        (
            ["plant.step_ms=3"],
            "--set plant.step_ms: a control period of 0.05 s must be a whole number of steps",
        ),
        (["plant.step_ms=100"], "must be a whole number of steps"),
        (["plant.step_ms=soon"], '--set plant.step_ms: must be a number or auto, not "soon"'),
        (["plant.step_ms=null"], "must be a number or auto, not null"),
        (["plant.step_ms=0"], "--set plant.step_ms: must be > 0"),
        (["plant.step_error_um=0"], "--set plant.step_error_um: must be > 0"),
        (["plant.spectral_radius=1.1"], "must be <= 1"),
        (["plant.noise_um=-1"], "must be >= 0"),
        (["plant.mismatch={density: 0}"], "--set plant.mismatch: plant.mismatch.density: must be > 0"),
        (["plant.measured_rings=[12]"], "there is no ring 12; tcr600 has rings 1 to 11"),
        (["plant.measured_rings=[3, 3]"], "ring 3 is listed more than once"),
        (["plant.measured_rings=[]"], "at least 1"),
        (["plant.measured_rings=none"], "must be all or a list of ring numbers"),
        (["robot=tcr60"], "--set robot: there is no robot named 'tcr60'; known: tcr5x4, tcr600, tcr700"),
        (["robot=./robot.yaml"], "there is no such file"),
        (["seed=-1"], "--set seed: must be >= 0, not -1"),
        (["criteria=[a.b ~ 3]"], "--set criteria: criteria.0: must be name relation number"),
        (["trajectory.kind=holt"], "--set trajectory.kind: must be one of"),
        (["log.flush_steps=0"], "--set log.flush_steps: must be >= 1, not 0"),
    ],
)
def test_contradictions_are_refused_where_they_stand(
    tmp_path: Path, overrides: list[str], message: str
) -> None:
    (found,) = problems_of(tmp_path, *overrides)
    assert message in found


def test_problems_of_options_experiment_and_robot_are_listed_together(tmp_path: Path) -> None:
    robot = shipped.robots()["tcr600"].read_text().replace("count: 11", "count: x")
    (tmp_path / "own.yaml").write_text(robot)
    text = SPEC.replace("tcr600", "./own.yaml").replace("kind: simulated", "kind: simulated, noise: 3")
    found = problems_of(tmp_path, "name.first=x", "controller.period_s=.inf", text=text)
    assert len(found) == 4
    assert found[0].startswith("--set name.first")
    assert found[1].startswith("--set controller.period_s: .inf is not a finite number")
    assert found[2].startswith("/standing.yaml:5:26: plant.noise: unknown key; did you mean noise_um?")
    assert found[3].startswith("/own.yaml:6:3: modules.count: must be a whole number")


def test_a_robot_path_starts_at_the_experiment_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own.yaml").write_bytes(shipped.robots()["tcr5x4"].read_bytes())
    monkeypatch.chdir("/")
    found = loaded(tmp_path, text=SPEC.replace("tcr600", "own.yaml"))
    assert found.robot.name == "tcr5x4"
    assert found.robot_path == tmp_path / "own.yaml"


def test_experiments_that_do_not_exist_are_named_with_those_that_do(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError) as caught:
        load_spec("leter_t")
    assert caught.value.allowed == tuple(shipped.experiments())
    assert "letter_t" in caught.value.hint
    with pytest.raises(InputError, match="no such file"):
        load_spec(str(tmp_path / "nothing.yaml"))


names = st.from_regex(r"[a-z][a-z0-9_]{0,8}(\.[a-z0-9_]{1,8}){0,2}", fullmatch=True)
limits = st.floats(allow_nan=False, allow_infinity=False) | st.booleans()
criteria = st.builds(Criterion, names, st.sampled_from(sorted(RELATIONS)), limits)


@pytest.mark.slow
@given(criteria)
def test_a_criterion_reads_back_what_it_writes(criterion: Criterion) -> None:
    adapter: TypeAdapter[Criterion] = TypeAdapter(CriterionText)
    assert adapter.validate_python(str(criterion)) == criterion
    assert adapter.validate_json(adapter.dump_json(criterion)) == criterion


@given(criteria, st.floats())
def test_a_criterion_compares_as_it_reads_and_nan_meets_none(criterion: Criterion, value: float) -> None:
    expected = eval(f"value {criterion.relation} criterion.limit") and not math.isnan(value)
    assert criterion.holds(value) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a",
        "a <= ",
        "<= 3",
        "a != 3",
        "a =< 3",
        "a <= 3 mm",
        "A <= 3",
        "a..b < 3",
        "a < nan",
        "a < 1e999",
        "a <= b",
    ],
)
def test_sentences_that_are_no_criterion_are_refused(text: str) -> None:
    with pytest.raises(ValidationError, match="name relation number"):
        TypeAdapter(CriterionText).validate_python(text)


@pytest.mark.parametrize(
    ("overrides", "seconds"),
    [
        ((), 0.0),
        (("controller.period_s=0.02",), 1.0),
        (("controller.period_s=0.02", "log.full_state_s=0.1"), 0.1),
        (("controller.period_s=0.02", "log.full_state_s=0"), 0.0),
        (("log.full_state_s=2",), 2.0),
        (("log.full_state_s=2", "estimator={kind: exact}"), 0.0),
    ],
)
def test_the_full_state_is_logged_every_step_up_to_20_hz_or_as_asked(
    tmp_path: Path, overrides: tuple[str, ...], seconds: float
) -> None:
    assert loaded(tmp_path, *overrides).spec.full_state_s == seconds


@pytest.mark.parametrize("value", ["fast", "-1", "[1]", "true"])
def test_an_interval_of_the_full_state_is_auto_or_a_time(tmp_path: Path, value: str) -> None:
    (problem,) = problems_of(tmp_path, f"log.full_state_s={value}")
    assert problem.startswith("--set log.full_state_s: must be 'auto', not ")
    assert "must be " in problem.partition("; ")[2]
