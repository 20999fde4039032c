"""The numbers of a run, from steps whose errors are known, and its verdict."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support import records
from tcrctl.cli.run_table import rows
from tcrctl.experiment.criterion import parse_criterion
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.summary import UNITS, Summary, judge
from tcrctl.numerics.rotation import normal_from_angles
from tcrctl.signals import RawFrame, Timing

UP = np.array([0.0, 0.0, 1.0])
N = 50


def step(k, error=(0.0, 0.0, 0.0), *, turn=(0.0, 0.0), wanted=(0.0, 0.0), free=False, truth=True, **changes):
    """Step k whose true end is ``error`` [m] and ``turn`` [rad] beside the wanted one."""
    made = records.record(k)
    normal = normal_from_angles(wanted[0] + turn[0], wanted[1] + turn[1])
    end = {"position": made.reference.position + np.array(error), "normal": normal}
    reference = replace(made.reference, normal=None if free else normal_from_angles(*wanted))
    assert made.truth is not None
    return replace(
        made,
        reference=reference,
        truth=replace(made.truth, **end) if truth else None,
        estimate=made.estimate if truth else replace(made.estimate, **end),
        **changes,
    )


def measures(steps, *, paced=True):
    metrics = Metrics(len(steps), paced=paced)
    for one in steps:
        metrics.add(one)
    return metrics.measures()


@pytest.mark.parametrize("truth", [True, False])
def test_position_errors_are_those_of_the_plant_or_else_of_the_estimate(truth):
    errors = 1e-3 * np.random.default_rng(1).standard_normal((N, 3))
    found = measures([step(k, e, truth=truth) for k, e in enumerate(errors)])
    size = 1e3 * np.linalg.norm(errors, axis=1)
    assert found.position_error_mm == pytest.approx(
        {"max": size.max(), "rms": np.sqrt((size**2).mean()), "mean": size.mean()}
    )
    x = 1e3 * errors[:, 0]
    assert found.x_error_mm == pytest.approx({"max": np.abs(x).max(), "rms": np.sqrt((x**2).mean())})
    assert (found.steps, found.duration_s) == (N, pytest.approx(N * records.PERIOD_S))


@pytest.mark.slow
@settings(deadline=None)  # the first call loads kernels
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_orientation_errors_are_those_of_the_angles(turn_x, turn_y, theta_x, theta_y):
    found = measures([step(0, turn=(turn_x, turn_y), wanted=(theta_x, theta_y))])
    assert found.theta_x_error_rad["max"] == pytest.approx(abs(turn_x), abs=1e-9)
    assert found.theta_y_error_rad["rms"] == pytest.approx(abs(turn_y), abs=1e-9)
    cosine = normal_from_angles(theta_x, theta_y) @ normal_from_angles(theta_x + turn_x, theta_y + turn_y)
    assert found.orientation_error_deg["max"] == pytest.approx(
        np.degrees(np.arccos(min(cosine, 1.0))), abs=1e-4
    )


def test_a_free_orientation_has_no_error():
    found = measures([step(k, turn=(0.1, 0.1), free=True) for k in range(3)])
    assert found.orientation_error_deg is None
    assert found.theta_x_error_rad is None
    assert found.theta_y_error_rad is None


def test_tension_saturation_iterations_and_unsolved_steps_are_counted():
    steps = []
    for k in range(10):
        made = step(k)
        info = replace(
            made.info, iterations=k, converged=k != 3, saturated=np.array([False, k in (1, 2), False])
        )
        truth = replace(made.truth, tension=np.array([5.0, 2.0 + 0.1 * k, 9.0 - 0.1 * k]))
        estimate = replace(made.estimate, converged=k not in (3, 7))
        steps.append(replace(made, info=info, truth=truth, estimate=estimate))
    found = measures(steps)
    assert found.tension_n == {"min": 2.0, "max": 9.0}
    assert found.saturated_fraction == pytest.approx(0.2)
    assert found.inner_iterations == {"mean": 4.5, "max": 9.0}
    assert found.unconverged_steps == 2


def test_control_time_is_that_of_estimator_and_controller():
    timings = [Timing(1.0, 1e-3 * k, 2e-3 * k, 1.0, 0.0) for k in range(101)]
    found = measures([step(k, timing=timing) for k, timing in enumerate(timings)], paced=False)
    assert found.control_ms == pytest.approx({"p50": 150.0, "p99": 297.0, "max": 300.0})


def test_overruns_are_steps_that_missed_their_period_by_the_clock():
    period = records.PERIOD_S
    timings = [
        Timing(0.0, 0.0, 0.0, 0.0, 0.9 * period),
        Timing(0.0, 0.0, 0.0, 0.0, 1.1 * period),
        Timing(0.3 * period, 0.3 * period, 0.3 * period, 0.0, 0.0),
        Timing(0.3 * period, 0.3 * period, 0.3 * period, 0.2 * period, 0.0),
    ]
    steps = [step(k, timing=timing) for k, timing in enumerate(timings)]
    assert measures(steps).overruns == 2
    assert measures(steps, paced=False).overruns == 0


def test_the_length_of_a_paced_run_is_that_of_the_clock():
    period = records.PERIOD_S
    timings = [Timing(0.0, 0.0, 0.0, 0.0, late) for late in (0.0, 0.9 * period, 9.0, 0.0)]
    steps = [step(k, timing=timing) for k, timing in enumerate(timings)]
    assert measures(steps).duration_s == pytest.approx(4 * period + 9.0)
    assert measures(steps, paced=False).duration_s == pytest.approx(4 * period)
    assert measures(steps[:3]).duration_s == pytest.approx(3 * period + 9.0)


@pytest.mark.parametrize(("late", "words"), [(1, "step, 5 %"), (9, "45 %")])
def test_a_summary_says_how_many_steps_were_overruns_and_they_can_be_a_criterion(late, words):
    timings = [Timing(0.0, 0.0, 0.0, 0.0, 1.1 * records.PERIOD_S * (k < late)) for k in range(20)]
    made = summary(
        measures([step(k, timing=timing) for k, timing in enumerate(timings)]), [f"overruns <= {late - 1}"]
    )
    (text,) = [text for name, text, _ in rows(made) if name == "overruns"]
    assert words in text
    assert "does not keep up" in text
    assert [(verdict.name, verdict.passed) for verdict in made.criteria] == [("overruns", False)]


def summary(found, criteria=()):
    made = Summary(
        "id", "spec", "robot", "simulated", "ioc", 0, (), "success", "", 0, found, (), Path("log.mcap")
    )
    return replace(made, criteria=judge([parse_criterion(text) for text in criteria], made.as_json()))


KEYS = [
    "run_id",
    "spec",
    "robot",
    "plant",
    "controller",
    "seed",
    "overrides",
    "status",
    "reason",
    "steps",
    "duration_s",
    "position_error_mm",
    "x_error_mm",
    "orientation_error_deg",
    "theta_x_error_rad",
    "theta_y_error_rad",
    "theta_singular_fraction",
    "tension_n",
    "saturated_fraction",
    "control_ms",
    "overruns",
    "inner_iterations",
    "unconverged_steps",
    "criteria",
    "log",
    "task",
    "versions",
]


def test_the_object_has_every_key_in_order_and_every_unit_names_a_number():
    made = summary(measures([step(k, turn=(0.1, 0.0)) for k in range(3)])).as_json()
    assert list(made) == KEYS
    on_a_rig = summary(measures([framed(k) for k in range(3)])).as_json()
    assert set(on_a_rig) == {*KEYS, "latency_ms"}
    for name in UNITS:
        value = on_a_rig if name.startswith("latency_ms") else made
        for part in name.split("."):
            value = value[part]
        assert isinstance(value, int | float)


def test_a_run_without_a_step_and_one_with_nan_are_valid_json():
    nothing = Metrics(5, paced=True).measures()
    made = json.loads(json.dumps(summary(nothing).as_json(), allow_nan=False))
    assert (made["steps"], made["position_error_mm"], made["control_ms"]) == (0, None, None)
    broken = measures([step(0, (np.nan, 0.0, 0.0)), step(1, (0.001, 0.0, 0.0))])
    made = json.loads(json.dumps(summary(broken).as_json(), allow_nan=False))
    assert made["position_error_mm"]["max"] is None


def test_criteria_are_judged_on_the_values_they_name():
    found = measures([step(0, (0.002, 0.0, 0.0), free=True)])
    asked = [
        "position_error_mm.max <= 3.0",
        "position_error_mm.max < 1.0",
        "steps == 1",
        "orientation_error_deg.max <= 90",
        "task.targets.0.beam_passes == true",
    ]
    judged = summary(found, asked).as_json()["criteria"]
    assert [item["passed"] for item in judged] == [True, False, True, False, False]
    assert judged[0] == {
        "name": "position_error_mm.max",
        "relation": "<=",
        "limit": 3.0,
        "value": pytest.approx(2.0),
        "unit": "mm",
        "passed": True,
    }
    assert judged[3]["value"] is None


def test_criteria_reach_into_what_the_task_asks():
    criterion = parse_criterion("task.targets.1.beam_passes == true")
    result = {"task": {"targets": [{"beam_passes": False}, {"beam_passes": True}]}}
    assert judge([criterion], result)[0].passed


def framed(k, *, lateness=0.0, delay=0.004, age=0.010, busy=0.006):
    """Step k whose camera frame was exposed ``age`` before the step's time and arrived ``delay`` later [s]."""
    none = np.zeros(0, np.int32)
    raw = RawFrame(k, 0, delay, none, np.zeros((0, 3), np.float32), none)
    made = step(k, truth=False)
    measurement = replace(made.measurement, t=made.t - age, raw=raw)
    return replace(
        made, measurement=measurement, timing=Timing(busy / 4, busy / 4, busy / 4, busy / 4, lateness)
    )


def test_latency_is_from_the_arrival_of_a_frame_to_the_answer_of_the_drives():
    found = measures(
        [framed(0), framed(1, lateness=0.02), framed(2, lateness=records.PERIOD_S + 0.01), step(3)]
    )
    early, late = 12.0, 32.0  # a step that is late by more than a period moves the clock of the run
    assert found.latency_ms == pytest.approx(
        {"p50": early, "p99": early + 0.98 * (late - early), "max": late}
    )
    assert measures([step(k) for k in range(3)]).latency_ms is None
