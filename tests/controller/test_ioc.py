"""The quadratic program (30) and its LCP: optimality, limits, soft tension rows, the paper's special case."""

from __future__ import annotations

import daqp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcrctl.controller.ioc import (
    TENSION_SLACK,
    Prediction,
    QuadraticProgram,
    Solution,
    Weights,
    build_ioc,
    solve_ioc,
)
from tcrctl.numerics.lcp import solve_lcp
from tcrctl.robot.response import POSE_ROWS

M = 6


def random_case(seed: int, blocks: int = 3, instants: int = 8, floor: float = -np.inf):
    """Draw a prediction, target and weights with physical magnitudes."""
    rng = np.random.default_rng(seed)
    gain = np.zeros((instants, POSE_ROWS + M, blocks * M))
    gain[:, :POSE_ROWS] = 0.2 * rng.standard_normal((instants, POSE_ROWS, blocks * M))
    gain[:, POSE_ROWS:] = 200.0 * np.abs(rng.standard_normal((instants, M, blocks * M)))
    free = np.zeros((instants, POSE_ROWS + M))
    free[:, :3] = 0.02 * rng.standard_normal((instants, 3))
    free[:, POSE_ROWS:] = 3.0 + 3.0 * rng.standard_normal((instants, M))
    output = np.array([7.2e4] * 3 + [44.0] * 3 + [1e-3] + [1e-5] * M)
    weights = Weights(output, 1.0, 3.5e3, floor, 60.0 if np.isfinite(floor) else np.inf, 1e-3)
    target, changes = np.zeros((instants, POSE_ROWS + M)), 0.02 * rng.standard_normal(blocks * M)
    high = np.full(blocks * M, 0.05)
    return Prediction(free, gain), target, changes, -high, high, weights


def cost(case, U: np.ndarray) -> float:
    """The cost (30), written out from its definition, halved; soft rows with quadratic slack."""
    prediction, target, changes, _, _, weights = case
    Y = prediction.free + prediction.gain @ U
    value = 0.5 * np.sum(weights.output * (Y - target) ** 2)
    u = np.vstack([np.zeros(M), U.reshape(-1, M)])
    value += 0.5 * weights.speed * np.sum(u**2)
    value += 0.5 * weights.speed_change * np.sum((np.diff(u, axis=0) - changes.reshape(-1, M)) ** 2)
    T = Y[:, POSE_ROWS:]
    low = np.maximum(weights.floor - T, 0.0) if np.isfinite(weights.floor) else np.zeros(1)
    high = np.maximum(T - weights.ceiling, 0.0) if np.isfinite(weights.ceiling) else np.zeros(1)
    return float(value + 0.5 / weights.softness * (np.sum(low**2) + np.sum(high**2)))


def solved(case) -> Solution:
    program = build_ioc(*case)
    return solve_ioc(program, case[0], case[5])


@pytest.mark.parametrize("seed", range(20))
def test_hessian_and_gradient_are_those_of_the_cost(seed):
    case = random_case(seed)
    program = QuadraticProgram(*build_ioc(*case))
    U = 0.03 * np.random.default_rng(seed + 100).standard_normal(program.g.shape[0])
    direction = np.random.default_rng(seed + 200).standard_normal(U.shape[0])
    slope = (cost(case, U + 1e-4 * direction) - cost(case, U - 1e-4 * direction)) / 2e-4
    assert slope == pytest.approx((program.H @ U + program.g) @ direction, rel=1e-6)
    quadratic = 0.5 * U @ program.H @ U + program.g @ U
    assert cost(case, U) - cost(case, 0 * U) == pytest.approx(quadratic, rel=1e-9)


@pytest.mark.parametrize("seed", range(60))
def test_box_problem_agrees_with_an_independent_solver(seed):
    case = random_case(seed)
    program = QuadraticProgram(*build_ioc(*case))
    size = program.g.shape[0]
    reference, _, flag, _ = daqp.solve(
        program.H, program.g, np.zeros((0, size)), program.high, program.low, np.zeros(size, dtype=np.int32)
    )
    assert flag == 1
    answer = solved(case)
    assert answer.solved
    np.testing.assert_allclose(answer.inputs, reference, atol=1e-8)


@pytest.mark.parametrize("seed", range(40))
def test_no_move_lowers_the_cost_with_soft_tension_rows(seed):
    case = random_case(seed, floor=1.0)
    answer = solved(case)
    assert answer.solved
    low, high = case[3], case[4]
    assert np.all(answer.inputs >= low - 1e-9)
    assert np.all(answer.inputs <= high + 1e-9)
    best = cost(case, answer.inputs)
    rng = np.random.default_rng(seed)
    for size in (1e-2, 1e-3, 1e-4):
        for _ in range(20):
            other = np.clip(answer.inputs + size * rng.standard_normal(low.shape[0]), low, high)
            # rows violated by less than TENSION_SLACK stay out of the LCP: their price is the slack of the optimum
            assert cost(case, other) >= best - 0.5 / case[5].softness * 48 * TENSION_SLACK**2


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_a_harder_floor_never_leaves_more_slack(seed):
    worst = []
    for softness in (1e-1, 1e-3):
        case = random_case(seed, floor=1.0)
        case = (*case[:5], case[5]._replace(softness=softness))
        answer = solved(case)
        if not answer.solved:  # reported, never silent: the controller holds the drives then
            return
        T = (case[0].free + case[0].gain @ answer.inputs)[:, POSE_ROWS:]
        low, high = np.maximum(1.0 - T, 0.0), np.maximum(T - 60.0, 0.0)
        worst.append(np.sum(low**2) + np.sum(high**2))
    assert worst[1] <= worst[0] + 1e-4


@pytest.mark.parametrize("seed", range(30))
def test_one_block_is_the_lcp_of_the_paper(seed):
    """(36)-(40) written out with Ĥ1 and ξ̂ as printed, solved as an LCP, gives the same input."""
    case = random_case(seed, blocks=1, instants=1)
    prediction, target, previous, low, high, weights = case
    Q, xi2 = np.diag(weights.output), -prediction.gain[0]
    R, W = weights.speed * np.eye(M), weights.speed_change * np.eye(M)
    H1 = np.linalg.inv(xi2.T @ Q @ xi2 + R + W) / 2.0
    H2 = 2.0 * H1 @ xi2.T @ Q
    inner = H2 @ (prediction.free[0] - target[0]) + 2.0 * H1 @ W @ previous
    phi = np.concatenate([inner - high, low - inner])
    T = np.block([[-H1, H1], [H1, -H1]])
    z, _, _, status = solve_lcp(-T, -phi)
    assert status == 0
    u = inner - H1 @ (z[:M] - z[M:])
    np.testing.assert_allclose(solved(case).inputs, u, atol=1e-9)


def test_inputs_at_rest_stay_at_rest_on_target():
    prediction, target, previous, low, high, weights = random_case(1)
    prediction = Prediction(target.copy(), prediction.gain)
    answer = solved((prediction, target, 0.0 * previous, low, high, weights))
    assert np.array_equal(answer.inputs, np.zeros_like(low))
    assert answer.pivots == 0


def test_an_unreachable_target_drives_inputs_to_their_limits_and_not_beyond():
    prediction, target, previous, low, high, weights = random_case(2)
    target[:, :3] = 10.0
    answer = solved((prediction, target, previous, low, high, weights))
    assert answer.solved
    assert np.isclose(np.abs(answer.inputs).max(), 0.05)
    assert np.all(np.abs(answer.inputs) <= 0.05 + 1e-12)
