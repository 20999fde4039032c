"""Laws of the controllers: rest stays rest, limits hold, doubt holds the drives, prediction matches the robot."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from support.closed_loop import (
    KINDS,
    PREDICTIONS,
    closed_loop,
    constant,
    ioc,
    pose_settings,
    resting,
    settings_of,
)
from tcrctl.controller.blocks import block_edges, superpose
from tcrctl.controller.controller import KINDS as CONTROLLERS
from tcrctl.controller.controller import PLANNERS, build_controller
from tcrctl.controller.cost import outputs
from tcrctl.controller.integral import IntegralAction
from tcrctl.controller.multi_step import MultiStep
from tcrctl.controller.prediction_settings import OffsetSettings, Prediction
from tcrctl.controller.settings import ControllerSettings, CostWeights, IntegralSettings, IocSettings
from tcrctl.plant.settings import Mismatch
from tcrctl.robot import dynamics, pose
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.response import POSE_ROWS


@pytest.mark.parametrize("kind", KINDS)
def test_on_target_at_rest_nothing_moves(tcr600, kind):
    controller = build_controller(settings_of(kind), tcr600)
    command, info = controller.control(resting(tcr600), constant(tcr600, controller))
    assert info.converged
    assert np.max(np.abs(command.speed)) < 2e-5


@pytest.mark.parametrize("prediction", PREDICTIONS)
def test_a_far_target_saturates_and_never_exceeds_the_speed_limit(tcr600, prediction):
    settings = ioc(prediction, speed_limit_mm_s=20.0, weights=CostWeights(speed=0.01, speed_change=0.0))
    controller = build_controller(settings, tcr600)
    command, info = controller.control(resting(tcr600), constant(tcr600, controller, (0.3, 0.0, 0.1)))
    assert np.max(np.abs(command.speed)) <= 0.02
    assert info.saturated.any() or not info.converged


def test_at_the_end_of_the_stroke_no_command_leads_beyond(tcr600):
    settings = ioc()
    controller = build_controller(settings, tcr600)
    low, high = tcr600.stroke
    for drive, offset in ((high - 1e-4, (0.0, 0.0, 0.3)), (low + 1e-4, (0.0, 0.0, -0.3))):
        estimate = resting(tcr600, np.full(3, drive))
        command, _ = controller.control(estimate, constant(tcr600, controller, offset))
        assert np.all(command.drive <= high + 1e-12)
        assert np.all(command.drive >= low - 1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_doubtful_estimate_holds_the_drives_and_says_so(tcr600, kind):
    controller = build_controller(settings_of(kind), tcr600)
    estimate = replace(resting(tcr600), converged=False)
    command, info = controller.control(estimate, constant(tcr600, controller, (0.01, 0.0, 0.02)))
    assert not info.converged
    assert info.reason
    assert np.array_equal(command.speed, np.zeros(3))
    assert np.array_equal(command.drive, estimate.drive)


@pytest.mark.parametrize("kind", KINDS)
def test_a_state_that_is_not_finite_holds_the_drives(tcr600, kind):
    controller = build_controller(settings_of(kind), tcr600)
    estimate = resting(tcr600)
    estimate.q[50] = np.nan
    command, info = controller.control(estimate, constant(tcr600, controller))
    assert not info.converged
    assert np.array_equal(command.speed, np.zeros(3))


def members(union):
    """Settings classes of a union that is told apart by ``kind``, by kind."""
    return {
        get_args(member.model_fields["kind"].annotation)[0]: member for member in get_args(get_args(union)[0])
    }


def test_the_tables_have_every_kind_that_a_file_may_name():
    assert {kind: settings for kind, (settings, _) in CONTROLLERS.items()} == members(ControllerSettings)
    assert set(PLANNERS) == set(members(Prediction))


@pytest.mark.parametrize("kind", ["multi_step", "one_step", "literal"])
def test_the_bare_name_of_a_prediction_stands_for_its_defaults(kind):
    bare = IocSettings(kind="ioc", prediction=kind)
    assert bare == IocSettings(kind="ioc", prediction={"kind": kind})
    assert IocSettings.model_validate_json(bare.model_dump_json()) == bare


def test_a_prediction_without_a_kind_is_the_multi_step_one():
    assert IocSettings(kind="ioc", prediction={"horizon_s": 0.6}).prediction.kind == "multi_step"


def test_the_last_input_is_what_was_sent(tcr600):
    """A step in doubt holds the drives, so the next one begins from standstill."""
    controller = build_controller(ioc(), tcr600)
    reference = constant(tcr600, controller, (0.01, 0.0, 0.02))
    command, _ = controller.control(resting(tcr600), reference)
    assert np.array_equal(controller.memory()["speed"].values, command.speed)
    controller.control(replace(resting(tcr600), converged=False), reference)
    assert not controller.memory()["speed"].values.any()
    assert not controller.memory()["needed"].values.any()


def test_same_inputs_give_the_same_bytes(tcr700):
    runs = [closed_loop(tcr700, pose_settings(), (0.01, 0.005, 0.03), 0.6, noise=50.0)[1] for _ in range(2)]
    assert runs[0].tobytes() == runs[1].tobytes()


@pytest.mark.slow
def test_it_goes_to_the_target_and_stays(tcr600):
    settings = ioc(weights=CostWeights(speed_change=220.0), offset=OffsetSettings(filter_s=0.5))
    errors, _, infos = closed_loop(tcr600, settings, (0.02, 0.0, 0.04), 8.0)
    assert all(info.converged for info in infos)
    assert errors[-20:].max() < 1e-4


@pytest.mark.slow
def test_no_lasting_error_on_a_plant_of_other_material(tcr700):
    """Law of offset and integral; a step of 5 cm wakes the dither, which then fades within its 100 s."""
    mismatch = Mismatch(springs_youngs_modulus=0.7, density=1.2)
    errors, speeds, infos = closed_loop(
        tcr700,
        pose_settings().model_copy(update={"dither": None}),
        (0.02, 0.01, 0.04),
        10.0,
        mismatch,
        noise=50.0,
        latency=10.0,
    )
    assert all(info.converged for info in infos)
    assert np.mean(errors[-40:]) < 2e-4
    assert np.abs(speeds).max() <= 0.05


STIFF = Mismatch(springs_youngs_modulus=1.4, cables_youngs_modulus=1.3, density=0.7)


@pytest.mark.slow
def test_a_plant_whose_slow_modes_are_half_as_fast_again_is_held(tcr700):
    errors, _, infos = closed_loop(
        tcr700, pose_settings(), (0.004, 0.002, 0.02), 12.0, STIFF, noise=50.0, latency=10.0
    )
    assert all(info.converged for info in infos)
    assert errors[-40:].max() < 2e-4


@pytest.mark.slow
def test_quick_changes_of_speed_pump_up_modes_that_the_model_does_not_know(tcr700):
    """Why W is as large as it is: the same loop with a sixteenth of it."""
    quick = pose_settings().weights.model_copy(update={"speed_change": 3.5e3 / 16})
    errors, _, _ = closed_loop(
        tcr700, pose_settings().model_copy(update={"weights": quick}), (0.004, 0.002, 0.02), 6.0, STIFF
    )
    assert errors[-20:].max() > 2.0 * errors[40:60].max()


@pytest.mark.slow
def test_without_integral_and_offset_a_mismatched_plant_keeps_an_error(tcr600):
    """The laws above would be empty if feedback alone removed the error."""
    mismatch = Mismatch(springs_youngs_modulus=0.7, density=1.2)
    errors, _, _ = closed_loop(tcr600, ioc(integral="off", offset="off"), (0.02, 0.0, 0.04), 6.0, mismatch)
    assert np.mean(errors[-20:]) > 1e-3


@pytest.mark.slow
@given(st.integers(1, 60), st.integers(1, 12))
@hypothesis_settings(deadline=None)
def test_blocks_cover_the_horizon_without_gaps(instants, blocks):
    blocks = min(blocks, instants)
    edges = block_edges(instants, blocks)
    assert edges[0] == 0
    assert edges[-1] == instants
    assert len(edges) == blocks + 1
    assert np.all(np.diff(edges) >= 1)


def test_superposed_ramps_are_the_response_to_block_speeds():
    """For a pure integrator y = d the outputs of block speeds are the summed drive lengths."""
    n, m, step = 10, 2, 0.1
    change = np.zeros((n, m, m + 1))
    for i in range(n):
        change[i, :, :m] = (i + 1) * step * np.eye(m)
    edges = block_edges(n, 3)
    free, gain = superpose(change, np.zeros(m), edges)
    U = np.array([0.3, -0.2, 0.1, 0.4, -0.5, 0.6])
    per_instant = np.repeat(U.reshape(3, m), np.diff(edges), axis=0)
    np.testing.assert_allclose(free + gain @ U, step * np.cumsum(per_instant, axis=0), atol=1e-12)


def test_the_forecast_is_what_the_robot_then_does(tcr700):
    """Multi-step prediction against the nonlinear simulation for small piecewise constant speeds."""
    settings = pose_settings()
    prediction = settings.prediction
    predictor = MultiStep(prediction, settings.period_s, tcr700)
    rng = np.random.default_rng(5)
    U = 0.004 * rng.standard_normal((prediction.blocks, 6))
    forecast = predictor.predict(rest := resting(tcr700), 0.0, outputs(rest, 0.0, tcr700), np.zeros(6))
    predicted = forecast.prediction.free + forecast.prediction.gain @ U.ravel()
    state = dynamics.rest_state(tcr700.rest.q, np.zeros(6))
    ws, scratch = make_workspace(tcr700.model), dynamics.make_scratch(tcr700.model)
    speeds = np.repeat(U, np.diff(block_edges(prediction.instants, prediction.blocks)), axis=0)
    actual, rule = [], dynamics.Rule(h=1e-3, rho=0.8)
    for speed in speeds:
        dynamics.advance(tcr700.model, state, speed, 0.05, rule, tcr700.weight, ws, scratch)
        actual.append(np.concatenate([pose.position(state.q, tcr700.tip), pose.normal(state.q, tcr700.tip)]))
    moved = np.array(actual) - np.concatenate([tcr700.rest_position, tcr700.rest_normal])
    error = np.array(actual) - predicted[:, :6]
    assert np.max(np.abs(error[:, :3])) < 0.05 * np.max(np.abs(moved[:, :3]))
    assert np.max(np.abs(error[:, 3:])) < 0.05 * np.max(np.abs(moved[:, 3:]))
    np.testing.assert_allclose(ws.tension, predicted[-1, POSE_ROWS:], atol=0.3)


def test_integral_action_is_bounded_and_does_not_wind_up():
    action = IntegralAction(IntegralSettings(gain_1_s=2.0, limit_mm=5.0), 0.05)
    error = np.array([1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0])
    for _ in range(200):
        shift = action.update(error, False)
    assert shift[:2] == pytest.approx([5e-3, -5e-3])
    frozen = IntegralAction(IntegralSettings(gain_1_s=2.0, limit_mm=5.0), 0.05)
    for _ in range(200):
        shift = frozen.update(error, True)
    assert np.array_equal(shift, np.zeros(6))


def test_integral_action_unwinds_even_while_saturated():
    action = IntegralAction(IntegralSettings(gain_1_s=2.0, limit_mm=5.0), 0.05)
    error = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(20):
        action.update(error, False)
    before = action.shift[0]
    assert action.update(-error, True)[0] < before
