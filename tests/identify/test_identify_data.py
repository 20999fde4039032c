"""Data and files of identifications: what is read, and what is refused where it stands."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.identify_data import CABLES, ROBOT, SPRINGS, identification, static_data, true_robot
from tcrctl.config import shipped, strict_yaml
from tcrctl.errors import InputError, SpecError, UnknownNameError
from tcrctl.identify.certainty import Combination
from tcrctl.identify.loading import load_identification
from tcrctl.identify.static_data import read_static
from tcrctl.robot.description import load_robot

HEADER = "configuration,drive_c1_mm,drive_c2_mm,drive_c3_mm,drive_c4_mm,point,x_mm,y_mm,z_mm\n"
ROW = "a,12,2,-4,2,m5.apex,1.5,2,-300\n"


def table(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "data.csv"
    path.write_text(text)
    return path


def problems(path: Path) -> list[str]:
    with pytest.raises(SpecError) as raised:
        read_static(path, load_robot(ROBOT))
    return [str(problem) for problem in raised.value.problems]


def test_a_table_says_the_same_as_yaml(tmp_path):
    text = HEADER + ROW + "a,12,2,-4,2,ring3,4,,-150\nb,0,0,0,0,end,0,0,-250\n"
    entries = [
        {
            "name": "a",
            "drives_mm": [12, 2, -4, 2],
            "points_mm": {"m5.apex": [1.5, 2, -300], "ring3": [4, None, -150]},
        },
        {"name": "b", "drives_mm": [0, 0, 0, 0], "points_mm": {"end": [0, 0, -250]}},
    ]
    other = tmp_path / "data.yaml"
    other.write_text(strict_yaml.dumps({"configurations": entries}))
    robot = load_robot(ROBOT)
    assert repr(read_static(table(tmp_path, text), robot)) == repr(read_static(other, robot))  # NaN != NaN


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADER.replace("z_mm", "z_m") + ROW, ":1:1: column 'z_mm' is missing"),
        (
            HEADER.replace("z_mm", "z_m") + ROW,
            ":1:1: unknown column 'z_m'; allowed: configuration, drive_c1_mm",
        ),
        (HEADER + ROW.replace("1.5", "nan"), ":2:1: x_mm: must be a finite number or empty, not 'nan'"),
        (HEADER + ROW.replace("1.5", "1,5"), ":2:1: the row has not as many cells as the header"),
        (HEADER + ROW.replace("12", ""), ":2:1: drive_c1_mm: a drive length is missing"),
        (HEADER + ROW + ROW, ":3:1: point: 'm5.apex' was measured before in 'a'"),
        (HEADER + ROW + ROW.replace("12", "13").replace("apex", "n1"), "had other drive lengths before"),
        (
            HEADER + ROW.replace("m5", "m6"),
            ":2:1: configurations.0.points_mm.m6.apex: tcr5x4 has no point 'm6.apex'",
        ),
        (
            HEADER + ROW.replace("12", "12000"),
            "12000 mm is outside the stroke, -100 to 200 mm; are these micrometres?",
        ),
        (HEADER + ROW.replace("12,2,-4,2", "0.012,0.002,0,0"), "are the lengths in metres?"),
        (HEADER + ROW.replace("1.5,2,-300", ",,"), "nothing is measured in this configuration"),
        (HEADER, "must have at least 1 entries"),
    ],
)
def test_what_is_wrong_with_a_table_is_said_where_it_stands(tmp_path, text, message):
    assert any(message in problem for problem in problems(table(tmp_path, text)))


def test_not_a_number_in_yaml_is_refused(tmp_path):
    path = tmp_path / "data.yaml"
    path.write_text(
        "configurations:\n  - {name: a, drives_mm: [0, 0, 0, 0], points_mm: {end: [.nan, 0, 0]}}\n"
    )
    assert any("is not a finite number" in problem for problem in problems(path))


def refused(tmp_path, parameters=(SPRINGS,), **more) -> str:
    with pytest.raises(SpecError) as raised:
        identification(tmp_path, static_data(true_robot()), parameters, **more)
    return str(raised.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"springs.young": {}}, "springs has no young; it has youngs_modulus_mpa"),
        ({"springs": {}}, "springs is a section, not a number"),
        ({"name": {}}, "name is 'tcr5x4', not a number"),
        ({"springs.tension_only": {}}, "springs.tension_only is True, not a number"),
        ({"modules.count": {}}, "modules.count is a whole number"),
        ({"cables.routes.0.rest_length_mm": {}}, "is not given in this robot"),
        ({"cables.routes.4.hole_deg": {}}, "a list of 4, there is no index 4"),
        ({"modules.damping_n_s_m": {}}, "is 0 in this robot, so low and high have to be given"),
        ({SPRINGS: {"low": 100}}, "the robot has 90, outside the bounds 100 to 180"),
        ({SPRINGS: {"low": -1}}, "-1 makes no valid robot"),
        ({SPRINGS: {"low": 80, "high": 70}}, "must be above low, 80, not 70"),
        ({SPRINGS: {"low": 0, "scale": "log"}}, "must be > 0 with scale: log, not 0"),
        ({"modules.ring_mass_fraction": {"high": 1.5}}, "1.5 makes no valid robot"),
    ],
)
def test_a_parameter_that_cannot_be_one_is_refused(tmp_path, parameters, message):
    assert message in refused(tmp_path, parameters)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"frame": {"offset": "displacement"}}, "frame.reference: required with offset: displacement"),
        ({"frame": {"offset": "displacement", "reference": "x"}}, "there is no configuration 'x'; known: c0"),
        ({"frame": {"yaw": "fit", "yaw_deg": 3}}, "has no meaning with yaw: fit"),
        ({"method": "simplex"}, "must be 'pso+least-squares', 'pso' or 'least-squares'"),
        ({"data": [{"file": "nothing.yaml"}]}, "nothing.yaml: there is no such file"),
        ({"robt": 1}, "unknown key; did you mean robot?"),
    ],
)
def test_contradictions_in_the_file_are_refused(tmp_path, more, message):
    assert message in refused(tmp_path, **more)


def test_every_shipped_identification_is_valid_and_named_as_its_file():
    assert "identify_table2" in shipped.identifications()
    for name in shipped.identifications():
        assert load_identification(name).spec.name == name
        assert name not in shipped.experiments()


def test_an_identification_is_not_taken_for_an_experiment():
    with pytest.raises(InputError) as raised:
        shipped.find_experiment("identify_table2")
    assert "tcrctl identify identify_table2" in raised.value.hint
    with pytest.raises(UnknownNameError, match="identify_table2"):
        shipped.find_identification("letter_t")


def test_a_flagged_combination_reads_as_a_sentence():
    assert str(Combination({SPRINGS: 1.0}, float("inf"))) == f"{SPRINGS} has no influence on the data"
    text = str(Combination({SPRINGS: 1.0, CABLES: -0.5}, 0.25, "cables.initial_tension_n"))
    assert f"{SPRINGS} (+1.00), {CABLES} (-0.50)" in text
    assert "assumed, not measured: cables.initial_tension_n (else uncertain by 25 %)" in text
