"""The kernel of one step against its parts, and what it does with a prediction that is no number."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.controller.blocks import make_grid
from tcrctl.controller.cost_arrays import fill_target
from tcrctl.controller.feedforward import needed_speeds, wanted_changes
from tcrctl.controller.ioc import Prediction, Weights, build_ioc, solve_ioc
from tcrctl.controller.optimum import Demand, optimum
from tcrctl.robot.response import POSE_ROWS

M, BLOCKS, INSTANTS = 6, 3, 8


def step(seed):
    rng, size = np.random.default_rng(seed), BLOCKS * M
    gain = 0.2 * rng.standard_normal((INSTANTS, POSE_ROWS + M, size))
    prediction = Prediction(0.02 * rng.standard_normal((INSTANTS, POSE_ROWS + M)) + 1.0, gain)
    poses, shift = 1.0 + 0.02 * rng.standard_normal((INSTANTS + 1, 6)), 1e-3 * rng.standard_normal(6)
    previous, needed = 0.01 * rng.standard_normal((2, M))
    demand = Demand(poses, shift, 1.0, previous, needed, np.full(size, -0.05), np.full(size, 0.05))
    output = np.array([7.2e4] * 3 + [44.0] * 3 + [1e-3] + [1e-5] * M)
    return (
        prediction,
        rng.standard_normal((6, M)),
        demand,
        make_grid(INSTANTS, BLOCKS, 0.4),
        Weights(output, 1.0, 3.5e3, -np.inf, np.inf, 1.0),
    )


@pytest.mark.parametrize("seed", range(10))
def test_it_is_program_and_solution_one_after_the_other(seed):
    prediction, rest_gain, demand, grid, weights = step(seed)
    solution, needed = optimum(prediction, rest_gain, demand, grid, weights)
    speeds = needed_speeds(rest_gain, weights.output, demand.poses, grid.edges, grid.ahead[0])
    target = fill_target(demand.poses, demand.shift, demand.tension, M)
    changes = wanted_changes(demand.previous, demand.needed, speeds)
    program = build_ioc(prediction, target, changes, demand.low, demand.high, weights)
    expected = solve_ioc(program, prediction, weights)
    assert solution.solved
    assert np.array_equal(needed, speeds[0])
    np.testing.assert_allclose(solution.inputs, expected.inputs, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        solution.outputs, prediction.free + prediction.gain @ solution.inputs, rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("part", ["free", "gain"])
def test_a_prediction_that_is_no_number_gives_no_solution_and_no_row(part):
    prediction, *rest = step(0)
    getattr(prediction, part)[-1, -1] = np.nan
    solution, needed = optimum(prediction, *rest)
    assert not solution.solved
    assert solution.rows == 0
    assert not solution.inputs.any()
    assert not needed.any()
