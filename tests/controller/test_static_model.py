"""Laws of the static model: what it predicts is where the robot comes to rest, and nothing in it swings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from support.closed_loop import closed_loop, constant, ioc, pose_settings, resting, situation
from tcrctl.controller.blocks import block_edges
from tcrctl.controller.controller import build_controller
from tcrctl.controller.prediction_settings import OffsetSettings
from tcrctl.controller.static import Static
from tcrctl.plant.settings import Mismatch
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.response import POSE_ROWS


def static(robot, estimate, **changes):
    """Forecast of the static model for an estimate (blocks as shipped), and the settings of its prediction."""
    settings = pose_settings(prediction="static", **changes)
    predictor = Static(settings.prediction, settings.period_s, robot, 0.0)
    forecast = predictor.predict(situation(robot, estimate))
    return forecast, settings.prediction


def pose_at(robot, q):
    return np.concatenate([pose.position(q, robot.tip), pose.normal(q, robot.tip)])


def test_the_forecast_is_the_equilibrium_that_the_drives_lead_to(tcr700):
    rng = np.random.default_rng(2)
    start = 0.01 * rng.random(6)
    shape = equilibrium(tcr700.model, start, tcr700.weight, tcr700.rest.q)
    estimate = replace(resting(tcr700, start), q=shape.q, tension=shape.tension)
    forecast, settings = static(tcr700, estimate, offset="off")
    U = 5e-4 * rng.standard_normal((settings.blocks, 6))
    predicted = forecast.prediction.free + forecast.prediction.gain @ U.ravel()
    held = np.diff(block_edges(settings.instants, settings.blocks)) * settings.horizon_s / settings.instants
    end = equilibrium(tcr700.model, start + held @ U, tcr700.weight, shape.q)
    moved = pose_at(tcr700, end.q) - pose_at(tcr700, shape.q)
    np.testing.assert_allclose(predicted[-1, :6], pose_at(tcr700, end.q), atol=0.03 * np.abs(moved).max())
    np.testing.assert_allclose(predicted[-1, POSE_ROWS:], end.tension, atol=0.1)


def test_the_forecast_does_not_depend_on_how_the_robot_swings(tcr700):
    still = resting(tcr700)
    swinging = replace(still, q=still.q + 1e-3, v=still.v + 0.1, position=still.position + 1e-3)
    one, _ = static(tcr700, still, offset="off")
    other, _ = static(tcr700, swinging, offset="off")
    np.testing.assert_array_equal(one.prediction.free, other.prediction.free)
    np.testing.assert_array_equal(one.prediction.gain, other.prediction.gain)


def test_with_a_short_filter_the_measured_end_counts_as_the_place_of_rest(tcr700):
    away = replace(resting(tcr700), position=tcr700.rest_position + np.array([3e-3, -2e-3, 1e-3]))
    forecast, _ = static(tcr700, away, offset=OffsetSettings(filter_s=1e-4))
    expected = np.tile(away.position, (16, 1))
    np.testing.assert_allclose(forecast.prediction.free[:, :3], expected, atol=1e-9)


@pytest.mark.slow
def test_on_a_perfect_plant_bare_statics_come_to_the_target(tcr700):
    settings = pose_settings(prediction="static", integral="off", offset="off")
    errors, _, infos = closed_loop(tcr700, settings, (0.0, 0.0, 0.03), 8.0)
    assert all(info.converged for info in infos)
    assert np.mean(errors[-20:]) < 3e-4


@pytest.mark.slow
def test_bare_statics_keep_the_error_of_a_mismatched_model(tcr700):
    """They do not look at the measured end; the plant's own sag stays."""
    errors, _, _ = closed_loop(
        tcr700,
        pose_settings(prediction="static", integral="off", offset="off"),
        (0.0, 0.0, 0.03),
        8.0,
        Mismatch(springs_youngs_modulus=0.7, density=1.2),
    )
    assert np.mean(errors[-20:]) > 5e-4


@pytest.mark.slow
def test_statics_that_feed_the_measured_end_back_shake_the_slow_modes_up(tcr700):
    """Fig. 16: a controller that takes the end for one that follows at once diverges; the dynamic one holds."""
    largest = {}
    for prediction in ("static", "multi_step"):
        errors, _, _ = closed_loop(tcr700, pose_settings(prediction=prediction), (0.01, 0.0, 0.03), 6.0)
        largest[prediction] = errors[-20:].max()
    assert largest["static"] > 0.01
    assert largest["multi_step"] < 1e-3


def test_literal_statics_end_in_balance(tcr600):
    controller = build_controller(ioc("static literal", integral="off", tension="off"), tcr600)
    command, info = controller.control(resting(tcr600), constant(tcr600, controller, (0.01, 0.0, 0.02)))
    assert info.converged
    assert np.max(np.abs(command.speed)) > 1e-4
    end = equilibrium(tcr600.model, command.drive, tcr600.weight, tcr600.rest.q)
    np.testing.assert_allclose(info.predicted_tension, end.tension, atol=1e-3)


def test_a_time_step_of_statics_is_refused():
    with pytest.raises(ValidationError, match="one_step is a time step of the equations of motion"):
        ioc("one_step", model="static")
