"""Identification: known parameters are found again, and what cannot be found is said."""

from __future__ import annotations

import numpy as np
import pytest

from support.identify_data import (
    CABLES,
    LONG,
    MASS,
    ROBOT,
    SPRINGS,
    identification,
    measured_shapes,
    static_data,
    true_robot,
)
from tcrctl.errors import InputError, RunInterruptedError
from tcrctl.executors.engine import Engine
from tcrctl.identify import identification as module
from tcrctl.identify.building import build_regression, with_lengths
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.identification import identify
from tcrctl.identify.loading import load_identification
from tcrctl.identify.parameters import look_up, start_of, with_values
from tcrctl.identify.statics import make_twins, rest_shapes, shape_slopes
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot

pytestmark = pytest.mark.slow

DRIVES = np.array([[12, 2, -4, 2], [6, 6, 6, 6]]) / 1e3
EVERY_KIND = (
    SPRINGS,
    CABLES,
    MASS,
    "cables.initial_tension_n",
    "cables.lead_mm",
    "modules.cone_height_mm",
    "modules.ring_diameter_mm",
    "springs.natural_length_mm",
    "cables.routes.1.hole_deg",
)


def found(result):
    return dict(zip((p.path for p in result.parameters), result.values, strict=True))


@pytest.mark.parametrize("by_length", [False, True])
@pytest.mark.parametrize("path", EVERY_KIND)
def test_sensitivities_through_the_tangent_are_those_of_finite_differences(path, by_length):
    description = load_robot(ROBOT)
    if by_length:
        if path == "cables.initial_tension_n":
            pytest.skip("given lengths leave no initial tension")
        description = with_lengths(description, build_robot(description).model.cables[:, 0])
    value = look_up(description.model_dump(mode="json"), path)

    def shapes_at(v):
        robot = build_robot(with_values(description, {path: v}))
        return robot, rest_shapes(robot, DRIVES)

    robot, shapes = shapes_at(value)
    twins = make_twins(lambda v: with_values(description, v), robot, {path: value})
    slopes = np.array([shape_slopes(robot, twins, q, d)[:, 0] for q, d in zip(shapes, DRIVES, strict=True)])
    step = 1e-3 * abs(value)
    expected = (shapes_at(value + step)[1] - shapes_at(value - step)[1]) / (2.0 * step)
    assert np.abs(expected).max() > 0.0
    assert slopes == pytest.approx(expected, rel=1e-3, abs=1e-4 * np.abs(expected).max())


def test_least_squares_finds_known_moduli_in_noisy_data(tmp_path):
    data = static_data(true_robot(LONG, springs=0.75, cables=1.2), noise_mm=0.1)
    result = identify(identification(tmp_path, data, (SPRINGS, CABLES), LONG), engine=Engine(1))
    start = load_robot(LONG)
    assert found(result)[SPRINGS] == pytest.approx(0.75 * start.springs.youngs_modulus_mpa, rel=0.02)
    assert found(result)[CABLES] == pytest.approx(1.2 * start.cables.youngs_modulus_mpa, rel=0.02)
    assert result.certainty.sigma == pytest.approx(0.1, rel=0.2)
    assert result.mean_error_after_mm < 0.2 < result.mean_error_before_mm
    assert result.mean_error_after_mm < result.held_out_error_mm < 0.3
    assert result.certainty.combinations == ()
    assert result.evaluations < 100


def test_the_spread_that_is_told_is_the_spread_over_repeated_measurements(tmp_path):
    truth = true_robot(springs=0.9)
    errors = []
    for seed in range(6):
        loaded = identification(tmp_path, static_data(truth, noise_mm=0.2, seed=seed), (SPRINGS,))
        result = identify(loaded, engine=Engine(1))
        true_value = 0.9 * load_robot(ROBOT).springs.youngs_modulus_mpa
        errors.append((found(result)[SPRINGS] - true_value) / result.certainty.std[0])
    assert 0.5 < np.std(errors) < 1.7  # 6 draws of a unit normal
    assert abs(np.mean(errors)) < 1.0


@pytest.mark.parametrize("strung_by", ["tension", pytest.param("length", marks=pytest.mark.thorough)])
def test_a_common_scale_of_stiffness_and_mass_is_flagged(tmp_path, strung_by):
    data = static_data(true_robot(LONG), noise_mm=0.1)
    loaded = identification(tmp_path, data, (SPRINGS, CABLES, MASS), LONG, strung_by=strung_by)
    result = identify(loaded, engine=Engine(1))
    common = [c for c in result.certainty.combinations if set(c.weights) == {SPRINGS, CABLES, MASS}]
    assert common
    assert list(common[0].weights.values()) == pytest.approx([1.0, 1.0, 1.0], abs=0.5)
    assert any(MASS in warning for warning in result.warnings)


def test_scaling_every_force_moves_nothing():
    """The symmetry behind the flag: moduli, masses and tensions times one factor give the same shapes."""
    description = load_robot(ROBOT)
    data = description.model_dump(mode="json")
    forces = (
        SPRINGS,
        CABLES,
        MASS,
        "modules.youngs_modulus_mpa",
        "springs.mass_g",
        "cables.initial_tension_n",
    )
    scaled = with_values(description, {path: 1.7 * look_up(data, path) for path in forces})
    assert measured_shapes(build_robot(scaled)) == pytest.approx(
        measured_shapes(build_robot(description)), abs=1e-6
    )


def test_a_parameter_without_influence_is_named(tmp_path):
    data = static_data(true_robot(), noise_mm=0.1)
    result = identify(identification(tmp_path, data, (SPRINGS, "tension_limit_n")), engine=Engine(1))
    assert "tension_limit_n has no influence on the data" in result.warnings
    assert not np.isfinite(result.certainty.std[1])
    assert result.as_json()["parameters"]["tension_limit_n"]["std"] is None


def turned(points):
    """Another frame: turned by 40 deg, elsewhere."""
    c, s = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    return points @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T + [10.0, -20.0, 1500.0]


def test_an_unknown_frame_is_found_along_with_the_parameters(tmp_path):
    data = static_data(true_robot(springs=0.8), noise_mm=0.05, place=turned)
    frame = {"offset": "fit", "yaw": "fit"}
    result = identify(identification(tmp_path, data, (SPRINGS,), frame=frame), engine=Engine(1))
    assert found(result)[SPRINGS] == pytest.approx(
        0.8 * load_robot(ROBOT).springs.youngs_modulus_mpa, rel=0.01
    )
    assert np.degrees(result.frame.yaw) == pytest.approx(40.0, abs=0.1)
    assert 1e3 * result.frame.offset == pytest.approx([10.0, -20.0, 1500.0], abs=0.5)


def test_a_mirrored_order_of_cables_is_recognised(tmp_path):
    data = static_data(true_robot(), place=lambda points: turned(points * [1.0, -1.0, 1.0]))
    frame = {"offset": "fit", "yaw": "fit", "mirrored": "try"}
    result = identify(identification(tmp_path, data, (SPRINGS,), frame=frame), engine=Engine(1))
    assert result.frame.mirrored
    assert result.mean_error_after_mm < 1e-3


def test_ring_centres_the_end_and_single_coordinates_are_enough(tmp_path):
    def points(shape):
        rings = shape.reshape(-1, 4, 3)[:, :3].mean(axis=1)
        return {
            "ring3": rings[3].tolist(),
            "end": [float(rings[5][0]), None, float(rings[5][2])],
            "m4.apex": shape[19].tolist(),
        }

    data = static_data(true_robot(springs=1.3), points=points)
    result = identify(identification(tmp_path, data, (SPRINGS,)), engine=Engine(1))
    assert found(result)[SPRINGS] == pytest.approx(
        1.3 * load_robot(ROBOT).springs.youngs_modulus_mpa, rel=1e-4
    )


def test_displacements_do_not_care_where_the_frame_is(tmp_path):
    drives = [[0, 0, 0, 0], [12, 2, -4, 2], [2, 10, 2, -4]]
    frame = {"offset": "displacement", "reference": "c0", "yaw": "fit"}
    data = static_data(true_robot(springs=0.9), drives_mm=drives, place=turned)
    result = identify(identification(tmp_path, data, (SPRINGS,), frame=frame), engine=Engine(1))
    assert found(result)[SPRINGS] == pytest.approx(
        0.9 * load_robot(ROBOT).springs.youngs_modulus_mpa, rel=1e-4
    )
    assert [group.name for group in result.groups] == ["c1", "c2"]


def test_the_swarm_is_repeatable_also_in_worker_processes(tmp_path):
    swarm = {"particles": 4, "iterations": 3}
    data = static_data(true_robot(springs=0.75), noise_mm=0.1, drives_mm=[[12, 2, -4, 2], [6, 6, 6, 6]])
    loaded = identification(tmp_path, data, (SPRINGS,), method="pso", pso=swarm, seed=5)
    here, there = identify(loaded, engine=Engine(1)), identify(loaded, engine=Engine(2))
    assert here.values == pytest.approx(there.values, rel=1e-12)
    assert here.mean_error_after_mm < here.mean_error_before_mm
    assert here.stages[0].evaluations == there.stages[0].evaluations == 12


def test_an_interruption_keeps_the_best_answer_so_far(tmp_path, monkeypatch):
    class Impatient(module.Interruption):
        looks = 0

        def check(self):
            self.looks += 1
            if self.looks > 4:
                raise RunInterruptedError(2, "SIGINT")

    monkeypatch.setattr(module, "Interruption", Impatient)
    loaded = identification(tmp_path, static_data(true_robot(springs=0.6), noise_mm=0.1), (SPRINGS, CABLES))
    result = identify(loaded, engine=Engine(1))
    assert (result.status, result.exit_code, result.certainty) == ("aborted", 130, None)
    assert result.mean_error_after_mm < result.mean_error_before_mm
    assert result.as_json()["held_out_error_mm"] is None


def test_fewer_data_than_unknowns_are_refused(tmp_path):
    drives, points = [[6, 6, 6, 6]], lambda shape: {"m5.apex": shape[-1].tolist()}
    data = static_data(true_robot(), drives_mm=drives, points=points)
    frame = {"offset": "fit", "yaw": "fit"}
    with pytest.raises(InputError, match="3 measured coordinates are too few for 6 unknowns"):
        identify(identification(tmp_path, data, frame=frame), engine=Engine(1))


def test_a_unit_off_by_1000_is_noticed(tmp_path):
    data = static_data(true_robot(), place=lambda points: points / 1e3)
    with pytest.raises(InputError, match="spread over") as raised:
        identify(identification(tmp_path, data), engine=Engine(1))
    assert "mm" in raised.value.hint


def test_the_shipped_robot_and_the_identified_one_predict_table_2():
    """Acceptance: 7.0 mm as shipped, where the paper's identified model has 7.77 mm, and 5.5 mm after."""
    result = identify(load_identification("identify_table2", ["method=least-squares"]), engine=Engine(1))
    assert result.mean_error_before_mm <= 7.0
    assert result.mean_error_after_mm <= 5.5
    assert len(result.parameters) <= 4
    assert all(np.isfinite(group.held_out_mm) for group in result.groups)
    for parameter, value in zip(result.parameters, result.values, strict=True):
        assert parameter.low <= value <= parameter.high


def test_predictions_cross_to_a_worker_unchanged(tmp_path):
    regression, _ = build_regression(identification(tmp_path, static_data(true_robot())))
    x = start_of(regression.parameters)
    with Evaluator(regression, Engine(2), lambda: None) as evaluator:
        first, second = evaluator.predict_many([x, x + 0.01])
    assert np.array_equal(first, regression.predict(x))
    assert not np.array_equal(first, second)
