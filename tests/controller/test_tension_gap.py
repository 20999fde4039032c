"""Laws of the tension gap: lasting differences are left out, and jumps are; nobody winds in."""

from __future__ import annotations

import numpy as np
import pytest

from support.closed_loop import closed_loop, ioc, resting, situation
from tcrctl.controller.multi_step import MultiStep
from tcrctl.controller.prediction_settings import MultiStepSettings, TensionGapSettings
from tcrctl.controller.tension_gap import TensionGap
from tcrctl.robot.response import POSE_ROWS

PERIOD = 0.05


def test_a_difference_that_was_there_from_the_start_lasts():
    gap = TensionGap(TensionGapSettings(), PERIOD, 3)
    for _ in range(5):
        np.testing.assert_allclose(gap.left_out(np.array([1.0, -2.0, 3.0])), [1.0, -2.0, 3.0])


def test_a_later_difference_lasts_after_the_time_constant():
    gap = TensionGap(TensionGapSettings(filter_s=1.0, smooth_s=0), PERIOD, 1)
    gap.left_out(np.zeros(1))
    found = [gap.left_out(np.ones(1))[0] for _ in range(round(1.0 / PERIOD))]
    assert found[0] == pytest.approx(1.0 - np.exp(-PERIOD))
    assert found[-1] == pytest.approx(1.0 - np.exp(-1.0))


def test_a_jump_of_one_frame_is_left_out_and_a_swing_of_a_second_is_believed():
    gap = TensionGap(TensionGapSettings(filter_s=10.0, smooth_s=0.2), PERIOD, 1)
    gap.left_out(np.zeros(1))
    jump = np.array([8.0])
    assert abs((jump - gap.left_out(jump))[0]) < 0.25 * jump[0]
    t = PERIOD * np.arange(400)
    swing = np.sin(np.pi * t)
    believed = [x - gap.left_out(np.array([x]))[0] for x in swing]
    assert 0.75 < np.max(believed[200:]) < 1.0


def test_without_smoothing_a_jump_is_believed_at_once():
    gap = TensionGap(TensionGapSettings(filter_s=1e6, smooth_s=0.0), PERIOD, 1)
    gap.left_out(np.zeros(1))
    assert gap.left_out(np.ones(1))[0] == pytest.approx(0.0, abs=1e-6)


def test_off_nothing_lasts_and_nothing_is_kept():
    gap = TensionGap(None, PERIOD, 2)
    assert not gap.left_out(np.ones(2)).any()
    assert gap.memory() == {}


def test_what_is_no_number_is_passed_over():
    gap = TensionGap(TensionGapSettings(), PERIOD, 2)
    gap.left_out(np.array([1.0, 2.0]))
    np.testing.assert_array_equal(gap.left_out(np.array([np.nan, 5.0])), [1.0, 2.0])


def test_its_memory_is_the_filter_itself():
    gap = TensionGap(TensionGapSettings(), PERIOD, 2)
    gap.left_out(np.ones(2))
    for name in ("tension_gap", "tension_smooth"):
        gap.memory()[name].values[:] = 4.0
    np.testing.assert_allclose(gap.left_out(np.full(2, 4.0)), 4.0)


@pytest.mark.parametrize("offset", ["off", {"filter_s": 0.3}])
def test_a_prediction_begins_at_the_models_tensions(tcr700, offset):
    """Whatever a robot at rest seems to be under."""
    settings = MultiStepSettings.model_validate({"kind": "multi_step", "offset": offset})
    predictor = MultiStep(settings, PERIOD, tcr700, 0.0)
    estimate = resting(tcr700)
    estimate.tension[:] *= 1.15
    for _ in range(3):
        forecast = predictor.predict(situation(tcr700, estimate))
        found = forecast.prediction.free[-1, POSE_ROWS:]
        np.testing.assert_allclose(found, tcr700.rest.tension, rtol=0.02)
    assert "tension_gap" in predictor.memory()


@pytest.mark.slow
def test_a_plant_whose_cables_are_tighter_than_the_model_knows_is_not_wound_in(tcr700):
    """Drives go where the end must go; a controller that believes the tensions winds all cables in, or out."""
    paths = {}
    for gap in ({"filter_s": 1.0}, "off"):
        settings = ioc(dither="off", tension_gap=gap)
        errors, speeds, _ = closed_loop(
            tcr700, settings, (0.0, 0.0, 0.0), 4.0, cables={"initial_tension": 1.15}
        )
        paths[str(gap)] = errors, PERIOD * np.cumsum(speeds, axis=0).mean(axis=1)
    (errors, wound), (_, believed) = paths.values()
    assert np.abs(wound).max() < 0.02
    assert errors[-1] < 0.3 * errors[0]
    assert believed[-1] > 0.1


@pytest.mark.slow
def test_nor_are_slacker_ones_paid_out(tcr700):
    errors, speeds, _ = closed_loop(
        tcr700, ioc(dither="off"), (0.0, 0.0, 0.0), 4.0, cables={"initial_tension": 0.85}
    )
    assert np.abs(PERIOD * np.cumsum(speeds, axis=0).mean(axis=1)).max() < 0.02
    assert errors[-1] < 0.3 * errors[0]
