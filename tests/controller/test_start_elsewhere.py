"""A robot that hangs beside its model from the start: its first commands are no jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from support.short_runs import short_spec
from tcrctl.experiment.prepare import build_parts, build_plant, prepare
from tcrctl.loop.loop import run_loop


def first_speeds(told):
    """Largest drive speeds of the first commands (5,) [m/s], and how far the robot hangs beside its model [m]."""
    experiment = prepare(
        short_spec(
            "plant.robot={base: {tilt_deg: [22.5, 0.0]}}",
            "plant.step_ms=2.5",
            "controller.dither=off",
            f"controller.prediction.offset.from_start={told}",
            f"estimator={{kind: passive_observer, fit_start: {told}}}",
        )
    )
    plant, state = build_plant(experiment)
    parts, offset = build_parts(experiment, plant, state)
    records = []
    run_loop(replace(parts, steps=5, record=records.append))
    return np.array([np.abs(step.wanted.speed).max() for step in records]), offset


def test_a_robot_that_hangs_beside_its_model_does_not_jump():
    speeds, beside = first_speeds("true")
    assert beside > 0.02
    assert speeds.max() < 2e-3


def test_without_a_fitted_start_its_first_command_is_the_limit():
    speeds, _ = first_speeds("false")
    assert speeds[0] > 0.04
